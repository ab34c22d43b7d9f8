"""Which colours of a picture presses have taught, which were filled in, and how well they are known."""

import numpy as np

from harness.basics.arrays import FloatArray, IntArray
from harness.sim.optics.lit_calibration import LitCalibration
from harness.sim.optics.tactile_calibration import TactileCalibration


def filled_share(surface: FloatArray, calibration: TactileCalibration) -> float | None:
    """Share of the sloped pixels whose bin of the table no press reached, though others as steep did.

    Such bins hold what the fit's smooth model says (``calibration.taxim.table``). Pixels steeper than any
    press are another matter: they are drawn as the steepest, and ``TactileImages.extrapolated`` counts them.

    Args:
        surface: ``(rows, columns)`` metres towards the camera, the untouched gel's own shape included.
        calibration: whose ``support`` is asked.

    Returns:
        0 to 1; 0 where nothing slopes. None where the calibration does not say what was pressed.
    """
    if calibration.header.slope_limit >= 1.0:
        return None
    row, column = _bins(surface, calibration)
    return float(np.mean(~calibration.support[row, column])) if len(row) else 0.0


def colour_error(surface: FloatArray, calibration: TactileCalibration) -> float | None:
    """Grey levels by which the table's colours in a picture are uncertain: a standard error.

    It is what other presses of the same gel would have changed; how well the table's *form* fits a sensor is
    said by presses left out, ``held_out_table_db`` of the header.

    Args:
        surface: as ``filled_share``.
        calibration: whose ``uncertainty`` is asked.

    Returns:
        Root mean square over the sloped pixels that are no steeper than the presses, and over the channels; 0
        where nothing slopes. None where the calibration does not say.
    """
    if not (isinstance(calibration, LitCalibration) and calibration.uncertainty.size):
        return None
    row, column = _bins(surface, calibration)
    errors = calibration.uncertainty[row, column].astype(np.float64)
    return float(np.sqrt(np.mean(errors**2))) if len(row) else 0.0


def _bins(surface: FloatArray, calibration: TactileCalibration) -> tuple[IntArray, IntArray]:
    """Rows and columns of the table of the pixels that slope, none steeper than the steepest press."""
    limit, bins = calibration.header.slope_limit, calibration.bins
    inner = surface / calibration.header.pitch
    down = 0.5 * (inner[2:, 1:-1] - inner[:-2, 1:-1])
    right = 0.5 * (inner[1:-1, 2:] - inner[1:-1, :-2])
    steep = np.hypot(down, right)
    # A millionth of a pixel is rounding, as it is to the optics.
    sloped = steep > 2.0**-20
    if limit < 1.0:
        sloped &= steep <= limit / np.sqrt(1.0 - limit * limit)
    row = np.floor(np.arctan(steep[sloped]) / (0.5 * np.pi / (bins - 1))).astype(np.int64)
    turn = np.arctan2(down[sloped] + 0.0, right[sloped] + 0.0) + np.pi
    column = np.floor(turn / (2.0 * np.pi / (bins - 1))).astype(np.int64)
    return row, column
