"""Training of Siamese networks, which find a target by its first appearance."""
