"""Solvers of the dials: causes in the scene for effects requested in the picture."""
