"""Presses by the place they press: the batch that every level of an object's touch is asked with."""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.errors import OutOfDomain, WrongUse
from harness.basics.faces.mesh_rays import first_distances
from harness.basics.geometry import frame_facing, inverse
from harness.basics.mesh import Mesh
from harness.sim.gel.height_map import SEARCH_DEPTH, STAND_OFF, rigid_poses
from harness.sim.gel.press_pose import contact_places

_UNIT_ERROR = 1e-6


@dataclass(frozen=True, eq=False)
class Presses:
    """``n`` presses of a gel, each as ``harness.sim.gel.press_pose.gel_from_object`` means one.

    Raises:
        WrongUse: shapes that do not belong together, numbers that are not finite, normals of another
            length than one.
    """

    points: FloatArray  #: ``(n, 3)`` m, places of the surface in the object's frame.
    normals: FloatArray  #: ``(n, 3)`` unit, outward there, smooth over bends (``press_pose.contact_place``).
    depths: FloatArray  #: ``(n,)`` m from the undeformed gel to the place along the gel's z axis.
    tilts: FloatArray  #: ``(n,)`` rad between the gel's z axis and the inward normal.
    azimuths: FloatArray  #: ``(n,)`` rad, where the gel's z axis leans to.
    yaws: FloatArray  #: ``(n,)`` rad about the gel's z axis.

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


def presses_of(mesh: Mesh, gel_from_object: FloatArray) -> Presses:
    """The presses of poses.

    The place is where the line through the gel's centre along its z axis first meets the object. A pose
    that ``press_pose.gel_from_object`` made is taken apart into what it was made from, but for angles that
    are the same turn, and the azimuth of a gel that is not tilted.

    Args:
        mesh: of the object.
        gel_from_object: ``(n, 4, 4)`` rigid.

    Raises:
        OutOfDomain: a pose that is not finite and rigid, or whose line meets nothing.
    """
    object_from_gel = inverse(rigid_poses(gel_from_object))
    inward = object_from_gel[:, :3, 2]
    starts = object_from_gel[:, :3, 3] - STAND_OFF * inward
    gaps = first_distances(starts, np.ascontiguousarray(inward), mesh.corners) - STAND_OFF
    gaps[gaps > SEARCH_DEPTH] = np.inf
    if not np.isfinite(gaps).all():
        bad = int(np.argmin(np.isfinite(gaps)))
        raise OutOfDomain(
            f"the line through the centre of gel {bad + 1} of {len(gaps)} meets nothing of the object, and "
            "presses no place of it; press elsewhere, or take touch.shapes = reference"
        )
    points = object_from_gel[:, :3, 3] + gaps[:, None] * object_from_gel[:, :3, 2]
    normals = np.array([place.normal for place in contact_places(mesh, points)]).reshape(-1, 3)
    leant = np.swapaxes(frames_facing(-normals), 1, 2) @ object_from_gel[:, :3, :3]
    across = np.hypot(leant[:, 0, 2], leant[:, 1, 2])
    tilts = np.arctan2(across, leant[:, 2, 2])
    azimuths = np.arctan2(leant[:, 1, 2], leant[:, 0, 2])
    ca, sa, ct, st = np.cos(azimuths), np.sin(azimuths), np.cos(tilts), np.sin(tilts)
    # The first column once azimuth and tilt are taken back: what is left is a turn about z. So yaws are
    # right where the tilt is too small for its azimuth to be.
    x, y, z = leant[:, 0, 0], leant[:, 1, 0], leant[:, 2, 0]
    left = np.arctan2(ca * y - sa * x, ct * (ca * x + sa * y) - st * z)
    return Presses(points, normals, -gaps, tilts, azimuths, azimuths + left)
