"""Attacks: hostile trackers, files, places and moments to be killed."""
