"""The lowest modes of a mesh: python examples/modes_of_a_mesh.py [MESH] [MATERIAL]."""

import sys

from harness.api import modes

mesh, material = (sys.argv[1:] + ["builtin:wrench", "steel"][len(sys.argv) - 1 :])[:2]
found = modes(mesh, material, count=6, edge=6e-3)
for frequency in found.solution.modes.frequencies[:6]:
    print(f"{frequency:8.1f} Hz")
print(f"none is missing: {found.solution.certified}; {sum(found.seconds.values()):.1f} s")
