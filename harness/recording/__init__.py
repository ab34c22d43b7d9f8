"""A run on the disk: steps, codecs, what a run carries, and how it is performed and resumed."""
