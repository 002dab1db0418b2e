"""Weights of the stacked denoising auto-encoder: ``simbench train encoder``."""
