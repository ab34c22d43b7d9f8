"""Functions of the API, one module per task."""
