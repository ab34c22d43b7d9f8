"""The silhouette in a window about an object, as a network sees it.

All is seen from the camera's side: the frame is turned about the vertical until the camera stands over its
x axis, so that what is hidden behind the object is always on the same side.
"""

from dataclasses import dataclass

import numpy as np

from experiments.shape_reconstruction.evidence import SeenMask
from experiments.shape_reconstruction.pcn.point_frame import PointFrame
from harness.basics.arrays import FloatArray
from harness.basics.geometry import apply, inverse

SIDE = 96
"""Pixels along each side of a window: 4 mm each of an object of 0.2 m."""

SPAN = 1.0
"""Half the window's width over the frame's reach: what was not touched may be as far out again."""

UNTOUCHED = PointFrame(np.zeros(3), 0.2)
"""The frame of a picture alone: where the scene puts an object, and about as large as one is."""


@dataclass(frozen=True)
class Turned:
    """A turn about the vertical through the origin of ``stand``."""

    angle: float  #: rad, from ``stand``'s x axis to the camera.

    @classmethod
    def towards(cls, look: SeenMask | None) -> "Turned":
        """That of a picture's camera; none without a picture."""
        x, y = (1.0, 0.0) if look is None else look.stand_from_camera[:2, 3]
        return cls(float(np.arctan2(y, x)))

    def inward(self, points: FloatArray) -> FloatArray:
        """``(n, 3)`` m of ``stand``, the camera over the x axis."""
        return points @ self._stand_from_turned

    def outward(self, points: FloatArray) -> FloatArray:
        """``(n, 3)`` m, back in ``stand``."""
        return points @ self._stand_from_turned.T

    @property
    def _stand_from_turned(self) -> FloatArray:
        c, s = np.cos(self.angle), np.sin(self.angle)
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def window_points(frame: PointFrame, eye: FloatArray) -> FloatArray:
    """``(SIDE * SIDE, 3)`` m: middles of the window's pixels, row by row from the top.

    The window faces the camera and stands upright, its middle half the frame's reach above the support.

    Args:
        frame: of the touches.
        eye: ``(3,)`` m, where the camera is, in the same frame of reference.
    """
    middle = frame.middle + np.array([0.0, 0.0, 0.5 * frame.reach])
    ahead = (middle - eye) / np.linalg.norm(middle - eye)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, ahead)
    steps = SPAN * frame.reach * ((np.arange(SIDE) + 0.5) * 2.0 / SIDE - 1.0)
    across, down = np.meshgrid(steps, steps)
    return np.asarray(middle + across.reshape(-1, 1) * right - down.reshape(-1, 1) * up)


def window_of(look: SeenMask, frame: PointFrame, turned: Turned) -> FloatArray:
    """``(1, SIDE, SIDE)``: 1 where the pixel's ray meets the silhouette, 0 beside it and beyond the picture.

    Args:
        look: the silhouette.
        frame: of the touches, turned.
        turned: how.
    """
    eye = turned.inward(look.stand_from_camera[:3, 3][None])[0]
    points = apply(inverse(look.stand_from_camera), turned.outward(window_points(frame, eye)))
    rows, columns = look.mask.shape
    column, row = (
        np.floor(look.focal_length * points[:, axis] / points[:, 2] + 0.5 * count).astype(int)
        for axis, count in ((0, columns), (1, rows))
    )
    inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns) & (points[:, 2] > 0.0)
    seen = np.zeros(len(points))
    seen[inside] = look.mask[row[inside], column[inside]]
    return seen.reshape(1, SIDE, SIDE)
