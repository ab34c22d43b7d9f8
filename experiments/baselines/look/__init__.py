"""The picture of an object: queries, methods, and the baseline of 1.0."""
