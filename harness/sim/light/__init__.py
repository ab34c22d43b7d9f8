"""What a scene camera sees of an object: appearance, visibility, shading."""
