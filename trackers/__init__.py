"""Trackers: particle filters, OpenCV's trackers, and `Still`, the baseline."""
