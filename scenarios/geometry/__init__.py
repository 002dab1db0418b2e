"""Reference lines of roads, floors and networks."""
