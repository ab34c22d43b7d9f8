"""Commands about vibration and sound."""
