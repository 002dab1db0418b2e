"""One dial or two turned up: what is filmed, where trackers break."""
