"""The far end of the cameras' cables."""
