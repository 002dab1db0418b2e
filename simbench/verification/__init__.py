"""Generate sequences and data sets again, and report what differs."""
