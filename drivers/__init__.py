"""One plain class per instrument: the near end of each cable."""
