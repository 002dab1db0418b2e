"""Rendering: trajectories and camera poses to frames and ground truth."""
