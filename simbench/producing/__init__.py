"""Data sets at any scale: what is wanted, made, delivered and recorded."""
