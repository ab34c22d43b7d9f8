"""The optics of a gel whose untouched surface was measured: heights held to a grid far below any sensor's.

Such a surface is added to every press and was subtracted from every given gel, so where the sum is flat
only rounding is left of its slope. The table goes by the direction of a slope however small, and rounding
would choose that direction. On a grid of 2^-20 pixels sums are exact and flat is flat; published maps, in
single precision, lie on that grid and are drawn as they were.
"""

import numpy as np

from harness.arrays import FloatArray
from harness.sim.optics import Optics, OpticsLevel, TactileImages
from harness.sim.tactile_calibration import TactileCalibration

_GRID = 2.0**20


class SnappedOptics(Optics):
    """As ``Optics``, in pixels inside.

    Args:
        calibration: of the sensor.
        level: how exactly.
        rest: ``(rows, columns)`` metres, the untouched gel's surface towards the camera.

    Raises:
        CalibrationRefused: ``smooth`` was asked of a calibration that has only a table.
        OutOfDomain: a rest surface of another shape, or not finite.
    """

    def __init__(self, calibration: TactileCalibration, level: OpticsLevel, rest: FloatArray) -> None:
        self._metres = rest
        super().__init__(calibration, level, _snapped(rest / calibration.header.pitch))

    def render(self, indentation: FloatArray) -> TactileImages:
        """As ``Optics.render``, metres of indentation."""
        self._refuse(indentation)
        # Held to the grid once, as a whole: of two parts each would bring rounding of its own.
        whole = _snapped((self._metres + indentation) / self.calibration.header.pitch)
        return super().render(whole - self._rest)

    @property
    def _per_pitch(self) -> float:
        return 1.0


def _snapped(pixels: FloatArray) -> FloatArray:
    snapped: FloatArray = np.rint(pixels * _GRID) / _GRID
    return snapped
