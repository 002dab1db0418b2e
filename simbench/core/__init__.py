"""Shared types: boxes, cameras, frames, sequences, trajectories, errors."""
