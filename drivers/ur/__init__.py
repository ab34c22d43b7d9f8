"""A Universal Robots arm: limits, motion, state, and the process that owns ur_rtde."""
