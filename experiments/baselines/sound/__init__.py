"""The sound of a strike: queries, methods, and the baseline of 1.0."""
