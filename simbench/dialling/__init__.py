"""From effects to causes: what makes a story look as its dials ask."""
