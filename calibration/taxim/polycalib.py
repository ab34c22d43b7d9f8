"""Taxim's own file of a colour table, written; ``harness.sim.optics.published_pack`` reads it."""

from pathlib import Path

import numpy as np

from harness.basics.npz_file import write_arrays
from harness.sim.optics.tactile_calibration import TactileCalibration


def write_polycalib(calibration: TactileCalibration, path: Path) -> None:
    """Write ``polycalib.npz``: the number of bins and one table a channel.

    The layout names its channels r, g, b and holds what OpenCV reads, blue first: ``grad_r`` is blue.
    Taxim's program takes it so, and so does ours.

    Args:
        calibration: whose table is written; pitch, background and quality have no place in the file.
        path: of the file.
    """
    red, green, blue = (calibration.table[..., c].astype(np.float64) for c in range(3))
    bins = np.array(calibration.bins, dtype=np.int64)
    write_arrays(path, {"bins": bins, "grad_r": blue, "grad_g": green, "grad_b": red})
