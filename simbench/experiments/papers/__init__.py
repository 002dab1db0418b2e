"""The experiments of three papers: published figures beside measured ones."""
