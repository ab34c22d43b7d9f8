"""A DATAQ acquisition box, and the impact hammer on it."""
