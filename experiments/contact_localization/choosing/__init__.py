"""Which place is touched next, by what the contacts so far say."""
