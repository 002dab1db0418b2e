"""The protocols of VOT: where trackers are started, and what segments amount to."""
