"""Whether a run's live readings agree with a model of its object, sense by sense, and with the twin."""
