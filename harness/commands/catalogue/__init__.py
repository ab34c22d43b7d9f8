"""``touchstone catalogue``: a folder of objects becomes ObjectFiles."""
