"""Where a gel is when it is pressed onto a place of an object.

The press is named by the place, not by the highest pixel: the line through the gel's centre along its
z axis meets the surface at the place, ``depth`` behind the undeformed gel. So depth, tilt and yaw
mean the same on every surface, and a map changes smoothly with each of them.
"""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import FloatArray, IntArray, read_only
from harness.basics.errors import OutOfDomain, WrongUse
from harness.basics.faces.nearest import plane_shares
from harness.basics.geometry import frame_facing, inverse, rotation_about, transform
from harness.basics.mesh import Mesh
from harness.sim.gel.gel import require_depth
from harness.sim.solid.surface_measure import nearest_on_surface

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
    return contact_places(mesh, point[None])[0]


def contact_places(mesh: Mesh, points: FloatArray) -> tuple[ContactPlace, ...]:
    """The places of a surface nearest to ``(n, 3)`` metres, each as ``contact_place`` gives it.

    Raises:
        WrongUse: a point that is not finite.
        OutOfDomain: a point that is farther than ``MOST_MOVED``; the distance is named.
    """
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
