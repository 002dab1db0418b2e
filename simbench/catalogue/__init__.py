"""The catalogue: what scenarios look like and what they test, on one page."""
