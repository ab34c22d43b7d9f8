"""What everything stands on: arrays, errors, quantities with units, transforms, meshes, materials, files."""
