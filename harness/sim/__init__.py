"""Reference simulators: one effect or one step of it in each file."""
