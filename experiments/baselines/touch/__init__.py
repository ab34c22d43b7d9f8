"""The picture of a press: queries, methods, and the baseline of 1.0."""
