"""A sound card without hardware."""
