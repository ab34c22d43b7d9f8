"""Which colours of a picture presses have taught, and which were filled in between them."""

import numpy as np

from harness.arrays import FloatArray
from harness.sim.tactile_calibration import TactileCalibration


def filled_share(surface: FloatArray, calibration: TactileCalibration) -> float | None:
    """Share of the sloped pixels whose bin of the table no press reached, though others as steep did.

    Such bins hold what the fit's smooth model says (``calibration.taxim.table_fit``). Pixels steeper than any
    press are another matter: they are drawn as the steepest, and ``TactileImages.extrapolated`` counts them.

    Args:
        surface: ``(rows, columns)`` metres towards the camera, the untouched gel's own shape included.
        calibration: whose ``support`` is asked.

    Returns:
        0 to 1; 0 where nothing slopes. None where the calibration does not say what was pressed.
    """
    limit, bins = calibration.header.slope_limit, calibration.bins
    if limit >= 1.0:
        return None
    inner = surface / calibration.header.pitch
    down = 0.5 * (inner[2:, 1:-1] - inner[:-2, 1:-1])
    right = 0.5 * (inner[1:-1, 2:] - inner[1:-1, :-2])
    steep = np.hypot(down, right)
    # A millionth of a pixel is rounding, as it is to the optics.
    sloped = (steep > 2.0**-20) & (steep <= limit / np.sqrt(1.0 - limit * limit))
    if not sloped.any():
        return 0.0
    row = np.floor(np.arctan(steep[sloped]) / (0.5 * np.pi / (bins - 1))).astype(np.int64)
    turn = np.arctan2(down[sloped] + 0.0, right[sloped] + 0.0) + np.pi
    column = np.floor(turn / (2.0 * np.pi / (bins - 1))).astype(np.int64)
    return float(np.mean(~calibration.support[row, column]))
