"""Weights of trained networks, each in a package of its own with its card.

A network's package holds ``weights.npz`` and ``weights.json``, so that the code digest
of a tracker that imports it changes with them, and no other tracker's does.
"""
