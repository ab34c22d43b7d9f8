"""Cameras that stream motion JPEG over HTTP: the GelSight and the scene camera."""
