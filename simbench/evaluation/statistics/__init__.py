"""Statistics over scenario instances: intervals, tests and breaking points."""
