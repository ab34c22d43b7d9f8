"""From modes and a strike to the pressure at a microphone."""
