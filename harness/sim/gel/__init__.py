"""What a press does to a gel: height maps, skirt, pressure, force, printed markers."""
