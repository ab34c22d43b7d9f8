"""Size by touch: contacts with their normals, against the surface of the model."""
