"""Programs that perform steps on the bench and estimate from the recording."""
