"""From the height map of a press to places on the object's surface, in the robot's base."""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import FloatArray, read_only
from harness.basics.geometry import apply

POINTS = 12
"""Places kept of a press."""

SHARE = 0.5
"""Of the deepest indentation: what lies deeper is the object's own surface, not gel that hangs from it."""

TOUCHED = 0.12e-3
"""M of indentation below which nothing was touched."""


NEAR = 6.0e-3
"""M before a touch within which the surface may be: the press, and the gel's and the model's errors."""

BETWEEN = 1.5e-3
"""M between places on a way that met nothing."""


@dataclass(frozen=True, eq=False)
class Patch:
    """Where a press met the object."""

    points: FloatArray  #: ``(POINTS, 3)`` m in base.
    normal: FloatArray  #: ``(3,)`` unit in base, out of the object: of the plane through them.
    base_from_gel: FloatArray | None = None
    """``(4, 4)`` pose of the gel as the arm reported it; None where the pose is unknown, and the points and
    the normal then tell whether two contacts are at one place."""

    @property
    def press_line(self) -> tuple[FloatArray, FloatArray]:
        """``(3,)`` centre of the gel in base in m, and ``(3,)`` unit press axis, into the object."""
        if self.base_from_gel is None:
            return self.points.mean(axis=0), -self.normal
        return self.base_from_gel[:3, 3], self.base_from_gel[:3, 2]


def free_line(base_from_gel: FloatArray, length: float, touched: bool) -> FloatArray:
    """``(n, 3)`` m in base: places that the middle of the gel has passed, on its straight way to a press.

    Args:
        base_from_gel: ``(4, 4)`` at the end of the way; z into the object.
        length: m of the way.
        touched: whether it ended at the object, whose surface is then nearer than ``NEAR`` to its end.
    """
    back = np.arange(NEAR if touched else 0.0, length, BETWEEN)
    return read_only(base_from_gel[:3, 3] - back[:, None] * base_from_gel[:3, 2])


def patch_of(heights: FloatArray, pitch: float, base_from_gel: FloatArray) -> Patch | None:
    """The places that a press met; None where the gel touched nothing.

    Args:
        heights: ``(rows, columns)`` m of indentation.
        pitch: m of gel that a pixel shows.
        base_from_gel: ``(4, 4)`` as the arm reported it; z into the object.
    """
    deepest = float(heights.max())
    if not deepest > TOUCHED:
        return None
    rows, columns = np.nonzero(heights >= SHARE * deepest)
    count = np.array(heights.shape)
    across = (columns - 0.5 * (count[1] - 1)) * pitch
    along = (rows - 0.5 * (count[0] - 1)) * pitch
    in_gel = np.column_stack([across, along, -heights[rows, columns]])
    # Of the plane z = a x + b y + c through the places, towards the gel: -z.
    terms = np.column_stack([in_gel[:, :2], np.ones(len(in_gel))])
    slope = np.linalg.lstsq(terms, in_gel[:, 2], rcond=None)[0]
    normal = np.array([slope[0], slope[1], -1.0])
    normal /= np.linalg.norm(normal)
    # Places far from each other: each the farthest from those before, the middle first.
    level = in_gel[:, :2]
    chosen = [int(np.linalg.norm(level - level.mean(axis=0), axis=1).argmin())]
    apart = np.linalg.norm(level - level[chosen[0]], axis=1)
    while len(chosen) < POINTS:
        chosen.append(int(apart.argmax()))
        apart = np.minimum(apart, np.linalg.norm(level - level[chosen[-1]], axis=1))
    points, rotation = apply(base_from_gel, in_gel[chosen]), base_from_gel[:3, :3]
    return Patch(read_only(points), read_only(rotation @ normal), read_only(base_from_gel.copy()))
