"""Training of networks on generated films: ``simbench train``."""
