"""What is needed to train the network of the paper as published, and not to run it."""
