"""Instruments of a bench, each opened by itself."""
