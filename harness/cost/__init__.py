"""What accuracy costs: curves, the choice of a setting, promises."""
