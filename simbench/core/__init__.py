"""Types that all rooms share: boxes, cameras, frames, sequences, trajectories."""
