"""Whether a new calibration's colours turn as those of a sensor of the same make do."""

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.errors import CalibrationRefused
from harness.sim.optics.shading import design
from harness.sim.optics.tactile_calibration import TactileCalibration

_TURNS = 24
_SLOPE = 0.4
"""Sine of the slope at which colours are compared; every press reaches it."""

_CLEAR = 0.1
"""By which the correlations of the two orders must differ for either to be believed."""


def check_order(smooth: FloatArray, like: TactileCalibration) -> None:
    """Refuse presses whose red and blue are exchanged against a calibration of the same make.

    Presses and background saved alike in the wrong order contradict nothing among themselves.

    Args:
        smooth: ``(120, 3)`` coefficients of the new presses.
        like: calibrated from pictures known to be right, the camera mounted the same way.

    Raises:
        CalibrationRefused: exchanged, or unlike in either order.
    """
    if len(like.smooth) == 0:
        raise CalibrationRefused(
            "the calibration to compare with has only a table; give one with a smooth model"
        )
    ours, theirs = _wheel(smooth), _wheel(like.smooth)
    straight, crossed = _correlation(ours, theirs), _correlation(ours[:, ::-1], theirs)
    if crossed > straight + _CLEAR:
        raise CalibrationRefused(
            f"colours correlate with {like.header.sensor} by {straight:.2f} as they are and by {crossed:.2f} "
            "with red and blue exchanged: the pictures are in the wrong order; say --channels bgr (or rgb)"
        )
    if straight < crossed + _CLEAR:
        raise CalibrationRefused(
            f"colours correlate with {like.header.sensor} by {straight:.2f} as they are and by {crossed:.2f} "
            "with red and blue exchanged: too close to tell the order; compare with a sensor of the same make"
        )


def _wheel(smooth: FloatArray) -> FloatArray:
    """``(turns, 3)`` grey levels of slopes all around, in the middle of the picture."""
    turns = 2.0 * np.pi * np.arange(_TURNS) / _TURNS
    normals = _SLOPE * np.column_stack([np.cos(turns), np.sin(turns)])
    shown: FloatArray = design(normals, np.zeros((_TURNS, 2))) @ smooth
    return shown


def _correlation(one: FloatArray, other: FloatArray) -> float:
    left, right = (part - part.mean(axis=0) for part in (one, other))
    return float((left * right).sum() / max(float(np.sqrt((left**2).sum() * (right**2).sum())), 1e-12))
