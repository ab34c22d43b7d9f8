"""Calibrate a gel from pictures of ball presses: python examples/calibration_of_a_gel.py FOLDER."""

import sys
from pathlib import Path

import touchstone

presses = Path(sys.argv[1])
found = touchstone.calibrate_taxim(presses, ball_radius=1.2e-3, pitch=1e-4, out=presses / "calibration.npz")
print("\n".join(found.summary()))
