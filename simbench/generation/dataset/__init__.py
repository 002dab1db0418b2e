"""Data sets of many sequences: request, production, manifest and index."""
