"""Run trackers over sequences, score the tracks, and compare scores."""
