"""Compute the lowest modes of a mesh: python examples/modes_of_a_mesh.py [MESH] [MATERIAL]."""

import sys

import touchstone

mesh, material = (sys.argv[1:] + ["builtin:wrench", "steel"][len(sys.argv) - 1 :])[:2]
found = touchstone.modes(mesh, material, count=6, edge=6e-3)
for frequency, damping in zip(found.frequencies_hz, found.dampings_per_s, strict=True):
    print(f"{frequency:8.1f} Hz, decays as exp(-{damping:.3g} t)")
print(f"none is missing: {found.certified}; {sum(found.seconds.values()):.1f} s")
