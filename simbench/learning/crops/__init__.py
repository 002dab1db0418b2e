"""Pictures of vehicles that networks learn from, and changes to them."""
