"""Making sequences anew, and telling what differs."""
