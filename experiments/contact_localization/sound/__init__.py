"""How probable the sounds of a run are, given where its strikes fell."""
