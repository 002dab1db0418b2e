"""What air, weather, lens and sensor do to a picture."""
