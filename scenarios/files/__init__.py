"""Scenario files: loading, samples of ranges and choices, variants."""
