"""Balls that roll and bounce on a floor."""
