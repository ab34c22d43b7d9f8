"""Size by sight: the outline of the object in one picture, beside that of its model."""
