"""Free vibration of a solid: stiffness, mass, Lanczos, modes."""
