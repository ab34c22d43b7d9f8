"""Measured strikes: blows, transfer functions, and the modes identified from them."""
