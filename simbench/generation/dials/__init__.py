"""Find the causes in the scene of the effects that dials request in the picture."""
