"""Scenarios: from YAML files to trajectories, occluders and camera paths."""
