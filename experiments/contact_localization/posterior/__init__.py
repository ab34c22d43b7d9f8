"""The posterior over places and yaws: grid, sound alone, and the paper's filter."""
