"""From a scenario and a seed to a sequence on disk."""
