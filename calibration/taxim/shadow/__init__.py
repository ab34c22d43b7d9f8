"""The shadows that a pressed ball throws."""
