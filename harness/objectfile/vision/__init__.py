"""The look of an ObjectFile: rays, shell, samples and the light along them."""
