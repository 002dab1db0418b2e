"""Shapes of roads and lines."""
