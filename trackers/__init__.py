"""Who follows: particle filters and the floor that every score must beat."""
