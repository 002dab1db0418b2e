"""Weights of the Siamese network with a head for boxes: ``simbench train siambox``."""
