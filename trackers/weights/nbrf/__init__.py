"""Weights of the networks of NBRF, with their card."""
