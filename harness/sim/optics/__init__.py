"""What the camera behind a gel sees, and back again: colour, shadows, depth."""
