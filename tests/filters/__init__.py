"""The particle filters before and after, and by the papers: ``make filters``."""
