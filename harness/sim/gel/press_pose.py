"""Where a gel is when it is pressed onto a place of an object.

The press is named by the place, not by the highest pixel: the line through the gel's centre along its
z axis meets the surface at the place, ``depth`` behind the undeformed gel. So depth, tilt and yaw
mean the same on every surface, and a map changes smoothly with each of them.
"""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import FloatArray, IntArray, read_only
from harness.basics.errors import OutOfDomain, WrongUse
from harness.basics.faces.mesh_rays import first_distances
from harness.basics.faces.nearest_surface import plane_shares
from harness.basics.geometry import frame_facing, inverse, rotation_about, transform
from harness.basics.mesh import Mesh
from harness.sim.gel.gel import require_depth
from harness.sim.gel.height_map import SEARCH_DEPTH, STAND_OFF, rigid_poses
from harness.sim.solid.walls import nearest_on_surface

MOST_MOVED = 2e-3
"""Metres between a contact as it is asked for and the surface: farther is another frame or unit."""

MOST_TILT = np.radians(60.0)
"""rad; beyond it the housing is on the object before the gel."""

_CREASE = np.cos(np.radians(40.0))
"""Of the angle between two faces, from which on they meet in an edge and not in a bend."""

_Z = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class ContactPlace:
    """A place of a surface."""

    point: FloatArray  #: ``(3,)`` metres, in the object's frame, on the surface.
    normal: FloatArray  #: ``(3,)`` unit, outward, smooth over bends.
    moved: float  #: metres from where it was asked for.


def contact_place(mesh: Mesh, asked: FloatArray) -> ContactPlace:
    """The place of a surface nearest to ``(3,)`` metres in the object's frame.

    Raises:
        WrongUse: it is not three finite numbers.
        OutOfDomain: it is farther than ``MOST_MOVED``; the distance is named.
    """
    point = np.asarray(asked, dtype=np.float64)
    if point.shape != (3,):
        raise WrongUse(f"a contact at {asked} is no place; give three finite numbers, x y z in metres")
    return _find_contacts(mesh, point[None])[0]


def _find_contacts(mesh: Mesh, points: FloatArray) -> tuple[ContactPlace, ...]:
    """Find the contact points of a surface nearest to ``(n, 3)`` points in m, as ``contact_place``."""
    for point in points:
        if not np.isfinite(point).all():
            raise WrongUse(f"a contact at {point} is no place; give three finite numbers, x y z in metres")
    places, faces = _nearest(mesh, points)
    found = zip(points, places, faces, strict=True)
    return tuple(_contact_place(mesh, point, place, int(face)) for point, place, face in found)


def _contact_place(mesh: Mesh, point: FloatArray, place: FloatArray, face: int) -> ContactPlace:
    moved = float(np.linalg.norm(place - point))
    if moved > MOST_MOVED:
        raise OutOfDomain(
            f"the contact ({point[0]:g}, {point[1]:g}, {point[2]:g}) m is {moved * 1e3:.4g} mm off the "
            f"surface; the limit is {MOST_MOVED * 1e3:g} mm{_hint(mesh, point, place)}"
        )
    # Between the normals at the face's corners, each over the faces that bend into this one (Phong).
    own = mesh.face_normals[face]
    near: IntArray = np.flatnonzero(mesh.face_normals @ own > _CREASE)
    weighted = mesh.face_normals[near] * mesh.face_areas[near, None]
    at_corners = np.stack(
        [weighted[(mesh.faces[near] == vertex).any(axis=1)].sum(axis=0) for vertex in mesh.faces[face]]
    )
    lengths = np.linalg.norm(at_corners, axis=1, keepdims=True)
    normal = np.asarray(own)
    if (lengths > 0.0).all():
        blend = plane_shares(mesh.corners[face], place) @ (at_corners / lengths)
        normal = blend / np.linalg.norm(blend)
    if not normal.any():
        raise OutOfDomain("the surface has no normal at the contact; move it off the sliver of a face")
    return ContactPlace(read_only(place), read_only(normal), moved)


def gel_from_object(
    place: ContactPlace,
    depth: float,
    tilt: float,
    azimuth: float,
    yaw: float,
    thickness: float = np.inf,
) -> FloatArray:
    """Return ``(4, 4)``, the object in the frame of a gel that is pressed onto a place.

    The untilted gel looks straight into the surface, its x axis where ``geometry.frame_facing`` puts
    it. The gel's own z axis is then leant by ``tilt`` towards the tangent direction at ``azimuth`` from
    that x axis (towards its y axis), about the place; last, the gel is turned by ``yaw`` about its z axis.

    Args:
        place: on the surface.
        depth: metres from the undeformed gel to the place along the gel's z axis; below 0 the gel is clear.
        tilt: rad between the gel's z axis and the inward normal, 0 to ``MOST_TILT``.
        azimuth: rad, the direction the gel's z axis leans to.
        yaw: rad.
        thickness: metres of the gel. A deeper press may pass the object, and its picture shows no contact.

    Raises:
        WrongUse: a number that is not finite, or a tilt out of its range.
        OutOfDomain: a press deeper than the gel is thick.
    """
    if not np.isfinite([depth, tilt, azimuth, yaw]).all():
        raise WrongUse(f"depth {depth}, tilt {tilt}, azimuth {azimuth}, yaw {yaw}: give finite numbers")
    if not 0.0 <= tilt <= MOST_TILT:
        raise WrongUse(
            f"a tilt of {np.degrees(tilt):g} deg; give 0 to {np.degrees(MOST_TILT):g} deg, and the side with "
            "--azimuth"
        )
    require_depth(depth, thickness)
    upright = frame_facing(-place.normal, 0.0)
    across = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    turned = upright @ rotation_about(across, tilt) @ rotation_about(_Z, yaw)
    return read_only(inverse(transform(turned, place.point + depth * turned[:, 2])))


def _nearest(mesh: Mesh, points: FloatArray) -> tuple[FloatArray, IntArray]:
    """``(n, 3)`` places of the surface nearest to ``(n, 3)`` points, and their ``(n,)`` faces."""
    anywhere = np.zeros(points.shape)
    places, faces = nearest_on_surface(mesh, points, anywhere, np.full(len(points), MOST_MOVED))
    far = np.flatnonzero(faces < 0)
    if len(far):
        low, high = mesh.bounds
        # No place of the surface is farther than the far corner of its box.
        farthest = np.maximum(np.abs(points[far] - low), np.abs(points[far] - high))
        reach = np.linalg.norm(farthest, axis=1) * (1.0 + 1e-9)
        places[far], faces[far] = nearest_on_surface(mesh, points[far], anywhere[far], reach)
    return places, faces


def _hint(mesh: Mesh, point: FloatArray, nearest: FloatArray) -> str:
    (place,), _ = _nearest(mesh, point[None] * 1e-3)
    if np.linalg.norm(place - point * 1e-3) <= MOST_MOVED:
        return "; read as millimetres it would be on it: write metres, or each number with its unit"
    x, y, z = np.round(nearest, 6) + 0.0  # no -0
    return f"; give a point of the surface, as the nearest, {x:g} {y:g} {z:g} (metres, mesh frame)"


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
    normals = np.array([place.normal for place in _find_contacts(mesh, points)]).reshape(-1, 3)
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
