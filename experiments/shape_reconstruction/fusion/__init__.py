"""One answer from the shape family, the smooth surface and the single-view prior."""
