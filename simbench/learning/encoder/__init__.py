"""Training of the stacked denoising auto-encoder that appearance models read."""
