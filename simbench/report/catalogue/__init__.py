"""A page of pictures of scenarios."""
