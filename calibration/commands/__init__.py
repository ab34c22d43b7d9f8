"""What ``touchstone calibrate`` offers, one command a module."""
