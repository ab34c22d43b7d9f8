"""What is tried: draws laid where the readings are, and shapes next to a hypothesis."""
