"""Networks trained on many domains at once, each with a branch of its own."""
