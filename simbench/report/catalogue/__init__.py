"""Catalogue: a page with pictures of scenarios."""
