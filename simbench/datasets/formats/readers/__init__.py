"""Readers of data set layouts, ours and those of others, one module a layout."""
