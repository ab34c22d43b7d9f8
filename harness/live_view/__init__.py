"""An object turned by hand: a page on this machine, and the pictures that it asks for."""
