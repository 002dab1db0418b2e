"""The regression gate: scores of this version against a baseline."""
