"""A microphone on a sound card."""
