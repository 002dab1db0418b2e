"""What is measured of a track, as functions of estimates and truth."""
