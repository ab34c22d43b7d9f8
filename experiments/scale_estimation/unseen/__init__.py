"""Size by the outline alone, of an object that nobody has drawn."""
