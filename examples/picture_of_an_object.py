"""A picture by an object's networks: python examples/picture_of_an_object.py OUT.png [OBJECTFILE]."""

import sys
from pathlib import Path

import touchstone

folder = sys.argv[2] if len(sys.argv) > 2 else "objects/mug"
rendered = touchstone.render_vision(
    folder, camera=(0.25, -0.2, 0.2), light=(1.0, -1.0, 1.0), size=(160, 120), out=Path(sys.argv[1])
)
print("\n".join(rendered.summary()))
error = rendered.error_estimate.networks_measured["psnr_db"]
print(f"{rendered.seconds['render']:.3f} s; networks measured at {error:.1f} dB")
