"""From a surface to the networks of an object's touch."""
