"""Built-in household objects, modelled procedurally."""
