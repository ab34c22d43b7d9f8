"""From a mesh to the networks of an ObjectFile. Nothing that runs at the bench imports this."""
