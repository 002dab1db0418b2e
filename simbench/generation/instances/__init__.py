"""The instances of a scenario: what each seed shows, and how far they differ."""
