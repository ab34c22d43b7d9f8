"""From modes to the network of an object's sound."""
