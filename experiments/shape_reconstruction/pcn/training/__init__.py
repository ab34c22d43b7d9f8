"""What is needed to train the point completion network, and not to run it."""
