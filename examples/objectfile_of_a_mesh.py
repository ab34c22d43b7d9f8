"""Build and check the sound of a mesh as an ObjectFile: python examples/objectfile_of_a_mesh.py FOLDER."""

import sys
from pathlib import Path

import touchstone

out = Path(sys.argv[1])
built = touchstone.build_objectfile("builtin:wrench", out, "steel", profile="smoke", count=6, edge=8e-3)
print(built.errors)
print("\n".join(touchstone.verify_object(out).summary()))
print(touchstone.load_object(out).description.name)
