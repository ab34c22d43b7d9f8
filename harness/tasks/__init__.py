"""What the API computes, one module per task."""
