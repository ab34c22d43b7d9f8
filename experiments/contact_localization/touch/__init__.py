"""How well tactile images fit an object at a place."""
