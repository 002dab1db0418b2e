"""What the camera sees: trajectories turned into frames and truth."""
