"""Household shapes drawn at random, as bodies of tetrahedra: what networks learn from."""
