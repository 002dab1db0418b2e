"""What happens on the road: a YAML story turned into trajectories."""
