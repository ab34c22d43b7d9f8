"""The commands of the ``touchstone`` program, one in each file."""
