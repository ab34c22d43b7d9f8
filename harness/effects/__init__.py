"""Effects: quantities computed on demand, what each needs, and when a scene calls for it."""
