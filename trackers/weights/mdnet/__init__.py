"""Weights of the multi-domain network: ``simbench train mdnet``."""
