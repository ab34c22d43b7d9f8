"""Presses by the place they press: the batch that every level of an object's touch is asked with."""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.errors import WrongUse
from harness.basics.geometry import frame_facing

_UNIT_ERROR = 1e-6


@dataclass(frozen=True, eq=False)
class Presses:
    """``n`` presses of a gel, each as ``harness.sim.gel.press_pose.gel_from_object`` means one.

    Attributes:
        points: ``(n, 3)`` m, places of the surface in the object's frame.
        normals: ``(n, 3)`` unit, outward there, smooth over bends (``press_pose.contact_place``).
        depths: ``(n,)`` m from the undeformed gel to the place along the gel's z axis.
        tilts: ``(n,)`` rad between the gel's z axis and the inward normal.
        azimuths: ``(n,)`` rad, where the gel's z axis leans to.
        yaws: ``(n,)`` rad about the gel's z axis.

    Raises:
        WrongUse: shapes that do not belong together, numbers that are not finite, normals of another
            length than one.
    """

    points: FloatArray
    normals: FloatArray
    depths: FloatArray
    tilts: FloatArray
    azimuths: FloatArray
    yaws: FloatArray

    def __post_init__(self) -> None:
        count = len(self.points)
        shapes = [self.points.shape, self.normals.shape, *(each.shape for each in self._angles())]
        if shapes != [(count, 3), (count, 3), *[(count,)] * 4]:
            raise WrongUse(
                f"presses of shapes {shapes}; give (n, 3) points and normals, and n of each number"
            )
        if not all(np.isfinite(each).all() for each in (self.points, self.normals, *self._angles())):
            raise WrongUse("a press has a number that is not finite; give metres and radians")
        lengths = np.linalg.norm(self.normals, axis=1)
        if (np.abs(lengths - 1.0) > _UNIT_ERROR).any():
            raise WrongUse(
                f"normals of lengths {lengths.min():.6g} to {lengths.max():.6g}; divide each by its length"
            )

    @classmethod
    def one(
        cls, point: FloatArray, normal: FloatArray, depth: float, tilt: float, azimuth: float, yaw: float
    ) -> "Presses":
        """One press, as ``press_pose.gel_from_object`` takes it."""
        angles = [np.array([number]) for number in (depth, tilt, azimuth, yaw)]
        return cls(point[None], normal[None], *angles)

    def __len__(self) -> int:
        return len(self.points)

    def __getitem__(self, which: IntArray | slice) -> "Presses":
        angles = [each[which] for each in self._angles()]
        return Presses(self.points[which], self.normals[which], *angles)

    @property
    def object_from_gel(self) -> FloatArray:
        """``(n, 4, 4)``: poses of the gel."""
        upright = frames_facing(-self.normals)
        ca, sa, ct, st = (turn(each) for each in (self.azimuths, self.tilts) for turn in (np.cos, np.sin))
        cb, sb = np.cos(self.yaws - self.azimuths), np.sin(self.yaws - self.azimuths)
        # Leaning about the axis across the azimuth, then the yaw: Rz(azimuth) Ry(tilt) Rz(yaw - azimuth).
        rows = (
            (ca * ct * cb - sa * sb, -ca * ct * sb - sa * cb, ca * st),
            (sa * ct * cb + ca * sb, -sa * ct * sb + ca * cb, sa * st),
            (-st * cb, st * sb, ct),
        )
        leant = np.stack([np.stack(row, axis=1) for row in rows], axis=1)
        poses = np.zeros((len(self), 4, 4))
        poses[:, :3, :3] = upright @ leant
        poses[:, :3, 3] = self.points + self.depths[:, None] * poses[:, :3, 2]
        poses[:, 3, 3] = 1.0
        return poses

    def _angles(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        return self.depths, self.tilts, self.azimuths, self.yaws


def frames_facing(axes: FloatArray) -> FloatArray:
    """``(n, 3, 3)``: ``geometry.frame_facing`` of ``(n, 3)`` unit axes at no yaw."""
    x, y, z = axes.T
    across = x * x + y * y
    near_pole = z < -0.9
    a = np.where(
        near_pole, (1.0 - z) / np.where(across > 0.0, across, 1.0), 1.0 / np.where(near_pole, 1.0, 1 + z)
    )
    rows = ((1.0 - x * x * a, -x * y * a, x), (-x * y * a, 1.0 - y * y * a, y), (-x, -y, z))
    frames = np.stack([np.stack(row, axis=1) for row in rows], axis=1)
    for pole in np.flatnonzero(near_pole & (across == 0.0)):
        frames[pole] = frame_facing(axes[pole], 0.0)
    return frames
