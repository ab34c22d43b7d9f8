"""Render an object with its networks: python examples/picture_of_an_object.py OUT.png [OBJECTFILE]."""

import sys
from pathlib import Path

import touchstone

folder, out = sys.argv[2] if len(sys.argv) > 2 else "mug", Path(sys.argv[1])
camera, light = (0.25, -0.2, 0.2), (1.0, -1.0, 1.0)
rendered = touchstone.render_vision(folder, camera=camera, light=light, size=(160, 120), out=out)
print("\n".join(rendered.summary()))
error = rendered.error_estimate.networks_measured["psnr_db"]
print(f"{rendered.seconds['render']:.3f} s; networks measured at {error:.1f} dB")
# A camera's picture is compared in the same way.
print(touchstone.compare_vision(folder, live=out, camera=camera, light=light).difference)
