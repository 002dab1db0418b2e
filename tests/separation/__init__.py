"""How well appearance models tell a target from its surroundings: docs/encoder.md."""
