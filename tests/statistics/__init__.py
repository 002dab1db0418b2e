"""Simulations of the statistics: coverage, power, false alarms; see ``__main__``."""
