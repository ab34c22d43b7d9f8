"""What a GelSight sees of an imported touch: ObjectFolder 2.0's own use of Taxim, with its calibration.

The published program takes millimetres a pixel from the real sensor and distances from a virtual camera with
others; slopes are a quarter too steep near the axis because of it, and the colours were fitted to them so.
"""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from harness.basics.arrays import ByteArray, FloatArray
from harness.basics.errors import CalibrationRefused
from harness.objectfile.published.touch import SEEN_DEPTH
from harness.sim.optics.kernels import change_exactly
from harness.sim.optics.published_pack import PRESSES, TABLE, read_published, read_table

PITCH = 0.1245e-3
"""m a pixel, of the published program."""

_CORE = 0.2
"""Of the depth of the press: what lies deeper in the untouched gel is contact."""

_KERNELS = (11, 5)
"""Pixels: widths of the blurs of what is not contact."""


@dataclass(frozen=True, eq=False)
class TaximPicture:
    """A published calibration made ready."""

    table: FloatArray  #: ``(bins, bins, 6, 3)`` RGB.
    rest: FloatArray  #: ``(rows, columns)`` pixels, the untouched gel towards the camera.
    base: FloatArray
    """``(rows, columns, 3)`` RGB: the untouched gel's picture less what the table says of its dome."""

    @classmethod
    def open(cls, folder: Path, shape: tuple[int, int]) -> "TaximPicture":
        """The calibration of a folder, for maps of a shape.

        Raises:
            CalibrationRefused: no published calibration, without the untouched gel's shape, or of another
            camera.
        """
        pack = read_published(folder, PITCH)
        if pack.rest is None or pack.rest.shape != shape:
            raise CalibrationRefused(
                f"{folder} has no untouched gel of {shape[0]} x {shape[1]} pixels (depth_bg.npy); give the "
                "folder that "
                f"ObjectFolder 2.0 publishes, with {TABLE} and {PRESSES}"
            )
        table, rest = read_table(folder / TABLE), pack.rest / PITCH
        return cls(table, rest, pack.calibration.background.astype(np.float64) - table_colours(rest, table))

    def colours(self, depth: FloatArray, pressed: float) -> FloatArray:
        """``(rows, columns, 3)`` RGB, 0 to 255, not rounded.

        Args:
            depth: ``(rows, columns)`` m from the camera.
            pressed: m, depth of the press.
        """
        height = (SEEN_DEPTH[1] - depth) / PITCH
        contact = height - self.rest > _CORE * pressed / PITCH
        # Blurred where nothing touches, in single precision as published.
        soft = height.astype(np.float32)
        for width in _KERNELS:
            soft = np.asarray(cv2.GaussianBlur(soft, (width, width), 0), np.float32)
            soft[contact] = height[contact]
        coloured = table_colours(soft.astype(np.float64), self.table) + self.base
        found: FloatArray = np.clip(coloured, 0.0, 255.0)
        return found

    def image(self, depth: FloatArray, pressed: float) -> ByteArray:
        """The picture, rounded; arguments as ``colours``."""
        return np.rint(self.colours(depth, pressed)).astype(np.uint8)

    def compat_image(self, depth: FloatArray, pressed: float) -> ByteArray:
        """The picture as the published program writes it: the greys below, and blue where red belongs."""
        return np.ascontiguousarray(self.colours(depth, pressed)[..., ::-1]).astype(np.uint8)


def table_colours(height: FloatArray, table: FloatArray) -> FloatArray:
    """``(rows, columns, 3)``: what a colour table says of a surface's slopes.

    Args:
        height: ``(rows, columns)`` pixels.
        table: ``(bins, bins, 6, 3)``: by steepness and direction, a polynomial of the place.
    """
    colours = np.empty((*height.shape, 3))
    change_exactly(height, table, colours)
    return colours
