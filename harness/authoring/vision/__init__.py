"""From a surface with its colours to the networks of an object's look."""
