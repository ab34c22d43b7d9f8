"""A point completion network, the paper's own kind: from touched places to points all over the object."""
