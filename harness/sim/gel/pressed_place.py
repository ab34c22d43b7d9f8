"""Which press a pose of a gel is: the place, depth, tilt and yaw that ``press_pose`` would make it from."""

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.errors import OutOfDomain
from harness.basics.faces.mesh_rays import first_distances
from harness.basics.geometry import inverse
from harness.basics.mesh import Mesh
from harness.sim.gel.height_map import SEARCH_DEPTH, STAND_OFF, rigid_poses
from harness.sim.gel.press_pose import contact_places
from harness.sim.gel.presses import Presses, frames_facing


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
    tilts, azimuths, yaws = _angles(leant)
    return Presses(points, normals, -gaps, tilts, azimuths, yaws)


def _angles(leant: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Of ``(n, 3, 3)`` rotations ``Rz(azimuth) Ry(tilt) Rz(yaw - azimuth)``: tilts, azimuths, yaws."""
    across = np.hypot(leant[:, 0, 2], leant[:, 1, 2])
    tilts = np.arctan2(across, leant[:, 2, 2])
    azimuths = np.arctan2(leant[:, 1, 2], leant[:, 0, 2])
    ca, sa, ct, st = np.cos(azimuths), np.sin(azimuths), np.cos(tilts), np.sin(tilts)
    # The first column once azimuth and tilt are taken back: what is left is a turn about z. So yaws are
    # right where the tilt is too small for its azimuth to be.
    x, y, z = leant[:, 0, 0], leant[:, 1, 0], leant[:, 2, 0]
    left = np.arctan2(ca * y - sa * x, ct * (ca * x + sa * y) - st * z)
    return tilts, azimuths, azimuths + left
