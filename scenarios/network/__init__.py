"""Traffic on users' own SUMO networks."""
