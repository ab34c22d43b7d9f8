"""Choice of the next press during a run, and the estimate that it is made from."""
