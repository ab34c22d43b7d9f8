"""Turns about the vertical that an object does not show: no reading can tell them apart.

Where the yaw is unknown, the posterior repeats itself under them. It is searched over one
period, and its hypotheses are then spread over all of them.
"""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.mesh import Mesh
from harness.basics.symmetry import find_symmetries

_UPRIGHT = np.radians(1.0)
_UNFELT = 0.3e-3
"""Metres, root mean square, by which a turn may move the surface and still not be felt."""

_GOLDEN = 0.6180339887498949


@dataclass(frozen=True, eq=False)
class Turning:
    """The turns about one vertical line that leave the object as it was.

    Attributes:
        centre: ``(3,)`` metres, a point of the line, in the object's frame.
        up: ``(3,)`` unit, the vertical in the object's frame.
        fold: how many steps make a turn; 1 for none, 0 for any angle.
    """

    centre: FloatArray
    up: FloatArray
    fold: int

    @property
    def period(self) -> float:
        """rad; 0 where any angle serves."""
        return 0.0 if self.fold == 0 else 2.0 * np.pi / self.fold

    def spread(self, count: int) -> FloatArray:
        """``(count,)`` rad: turns of the group, evenly used, in no rhythm that an order could share."""
        parts = np.mod((np.arange(count) + 0.5) * _GOLDEN, 1.0)
        if self.fold == 0:
            return np.asarray(2.0 * np.pi * parts)
        return np.asarray(np.floor(self.fold * parts) * self.period)

    def copies(self, weights: FloatArray, most: int) -> tuple[IntArray, FloatArray, FloatArray]:
        """Hypotheses repeated under turns of the group, the heavier the more often.

        The few hypotheses that sound leaves would otherwise stand for as few turns.

        Args:
            weights: ``(n,)``, summing to 1.
            most: no copy weighs more than one part in so many.

        Returns:
            ``(c,)`` whose copy each is, rising; ``(c,)`` rad of its turn; ``(c,)`` weights, summing to 1.
        """
        if self.fold == 1:
            return np.arange(len(weights)), np.zeros(len(weights)), weights
        each = np.ceil(weights * most).clip(min=1.0).astype(np.int64)
        owners = np.repeat(np.arange(len(each)), each)
        return owners, self.spread(len(owners)), (weights / each)[owners]

    def turned(self, points: FloatArray, angles: FloatArray) -> FloatArray:
        """``(n, 3)`` points in the object's frame, each turned by its own of ``(n,)`` rad."""
        if self.fold == 1:
            return points
        away = points - self.centre
        along = np.outer(away @ self.up, self.up)
        cosines, sines = np.cos(angles)[:, None], np.sin(angles)[:, None]
        turned = along + cosines * (away - along) + sines * np.cross(self.up, away)
        return np.asarray(self.centre + turned)


def turning_of(mesh: Mesh, up: FloatArray) -> Turning:
    """The turns about ``(3,)`` ``up`` that cannot be felt; none where the object shows every one.

    Args:
        mesh: of the object, in metres.
        up: unit vector, the vertical in the object's frame.
    """
    group = find_symmetries(mesh)
    upright = abs(float(group.axis @ up)) > np.cos(_UPRIGHT)
    if group.fold == 1 or not upright or group.rms > _UNFELT:
        return Turning(np.asarray(group.centre), up, 1)
    axis = group.axis if float(group.axis @ up) > 0.0 else -group.axis
    return Turning(np.asarray(group.centre), np.asarray(axis), group.fold)
