"""Weights of the network with a filter: ``simbench train cfnet``."""
