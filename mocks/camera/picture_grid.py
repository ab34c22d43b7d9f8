"""The pixels of a sensor as it was made: their pitch, and that they need not be square."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import map_coordinates

from harness.basics.arrays import FloatArray
from harness.bench.sensor import TactileSensor
from harness.sim.gel.height_map import RasterMesh, height_maps

_FAR = 0.5e-3
"""Metres of gap that count as none: the jump from an object's outline to nothing must not ring."""


@dataclass(frozen=True)
class PictureGrid:
    """Where the pixels of one camera look.

    Attributes:
        sensor: its pitch is that along the rows: from one column to the next.
        aspect: pitch from one row to the next over that from one column to the next.
    """

    sensor: TactileSensor
    aspect: float = 1.0

    @classmethod
    def drawn(cls, nominal: TactileSensor, pitch: float, aspect: float) -> "PictureGrid":
        """A make's sensor whose column pitch is ``pitch`` times the stated one."""
        return cls(replace(nominal, pitch=nominal.pitch * pitch), aspect)

    @property
    def mean_pitch(self) -> float:
        """Metres a pixel, of a square one of the same area."""
        return float(self.sensor.pitch * np.sqrt(self.aspect))

    def gaps(self, raster: RasterMesh, gel_from_object: FloatArray) -> FloatArray:
        """``(rows, columns)`` metres, as ``height_maps`` has it; of other than square pixels, by splines.

        Args:
            raster: the object.
            gel_from_object: ``(4, 4)`` rigid.
        """
        if self.aspect == 1.0:
            return np.asarray(height_maps(raster, gel_from_object[None], self.sensor)[0])
        # As many rows more above as below: at an aspect of one the rows are those of the sensor.
        more = int(np.ceil(0.5 * self.sensor.rows * max(self.aspect - 1.0, 0.0))) + 3
        tall = replace(self.sensor, rows=self.sensor.rows + 2 * more)
        square = np.minimum(height_maps(raster, gel_from_object[None], tall)[0], _FAR)
        rows = (np.arange(self.sensor.rows) + 0.5 - self.sensor.rows / 2) * self.aspect
        at = np.meshgrid(rows + tall.rows / 2 - 0.5, np.arange(self.sensor.columns), indexing="ij")
        gap = np.asarray(map_coordinates(square, at, order=3, mode="nearest"), dtype=np.float64)
        return np.where(gap < 0.5 * _FAR, gap, np.inf)
