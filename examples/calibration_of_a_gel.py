"""A calibration from pictures of ball presses: python examples/calibration_of_a_gel.py FOLDER."""

import sys
from pathlib import Path

import touchstone

found = touchstone.calibrate_taxim(Path(sys.argv[1]), ball_radius=1.2e-3, pitch=1e-4)
print("\n".join(found.summary()))
