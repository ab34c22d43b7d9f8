"""URScript: text to syntax tree to steps that take simulated time (Universal Robots, Script manual)."""
