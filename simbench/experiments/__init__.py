"""Runs of many trackers on many scenarios and seeds, and their run folders."""
