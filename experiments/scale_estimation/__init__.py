"""Scale estimation: how big is an object, by sight, by sound, by touch, and by all three."""
