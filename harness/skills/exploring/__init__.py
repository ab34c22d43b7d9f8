"""Exploring an object of which too little is known: the space that it may take, and straight ways into it."""
