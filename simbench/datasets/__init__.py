"""Sequences on disk: reading and writing the layouts that simbench supports."""
