"""Tactile optics: from ball presses to the colour a surface slope gives."""
