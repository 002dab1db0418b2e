"""Highway traffic, simulated by SUMO in a child process."""
