"""Weights of the Siamese network: ``simbench train siamfc``."""
