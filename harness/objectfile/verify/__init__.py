"""Whether an ObjectFile is whole and says what it claims."""
