"""Sequences on disk: reading and writing the layouts that the bench knows."""
