"""A box of cells that holds all the space in which an object may be."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from experiments.shape_reconstruction.estimators.one_body import BodySurface, extract_body
from harness.basics.arrays import FloatArray

MOST_CORNERS = 200_000
"""Of a grid: beyond it the cells are made larger."""

BAND = 3.0
"""Pitches from zero, within which every corner is asked."""


@dataclass(frozen=True, eq=False)
class Grid:
    """Corners of cubic cells.

    Attributes:
        origin: ``(3,)`` m in ``stand``, of the first corner.
        pitch: m between corners.
        shape: corners along x, y, z.
    """

    origin: FloatArray
    pitch: float
    shape: tuple[int, int, int]

    @classmethod
    def over(cls, low: FloatArray, high: FloatArray, pitch: float) -> "Grid":
        """The grid from one corner of a box to the other, coarser where ``MOST_CORNERS`` demand it."""
        sides = np.maximum(high - low, pitch)
        pitch = max(pitch, float((sides.prod() / MOST_CORNERS) ** (1.0 / 3.0)))
        count = np.ceil(sides / pitch).astype(int) + 1
        middle = 0.5 * (low + high)
        origin = middle - 0.5 * pitch * (count - 1)
        origin[2] = low[2]  # the support is a plane of corners
        return cls(origin, pitch, (int(count[0]), int(count[1]), int(count[2])))

    @property
    def points(self) -> FloatArray:
        """``(n, 3)`` m, all corners, the last axis fastest."""
        axes = [self.origin[axis] + self.pitch * np.arange(self.shape[axis]) for axis in range(3)]
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)

    def near_zero(self, field: Callable[[FloatArray], FloatArray]) -> FloatArray:
        """``(n,)`` m of a field that grows by about a metre a metre: exact near zero, else between corners.

        Every second corner is asked, and the others where the field may be zero nearby.

        Args:
            field: m at ``(n, 3)`` m.
        """
        half = tuple((count + 2) // 2 for count in self.shape)
        coarse = Grid(self.origin, 2.0 * self.pitch, (half[0], half[1], half[2]))
        known = field(coarse.points).reshape(half)
        at = np.indices(self.shape).reshape(3, -1) / 2.0
        values = np.asarray(ndimage.map_coordinates(known, at, order=1, mode="nearest"))
        band = np.abs(values) < BAND * self.pitch
        values[band] = field(self.points[band])
        return values

    def surface(self, field: FloatArray, contacts: FloatArray | None = None) -> BodySurface:
        """Extract the closed surface of the one body where a field is below zero.

        Args:
            field: ``(n,)`` signed distance at the corners, m.
            contacts: ``(n, 3)`` points of the surface that were touched, m; they decide which piece is the
                body.

        Raises:
            OutOfDomain: as ``isosurface``.
        """
        return extract_body(field.reshape(self.shape), self.origin, self.pitch, contacts)
