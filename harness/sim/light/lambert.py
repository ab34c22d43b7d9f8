"""Matt surfaces under light from far away: exact at every place, in linear light."""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import FloatArray, IntArray, read_only
from harness.basics.compiled import compiled
from harness.basics.errors import OutOfDomain
from harness.sim.light.appearance import Appearance

Three = tuple[float, float, float]
"""Numbers along x, y, z."""

_LIFTED = 1e-9
"""Shares of a face's size: a place lifted by less lies on its face."""


@dataclass(frozen=True, eq=False)
class Places:
    """Places of a surface, each on the side that is seen."""

    faces: IntArray  #: ``(n,)`` indices.
    points: FloatArray  #: ``(n, 3)`` m, in the object's frame.
    normals: FloatArray  #: ``(n, 3)`` unit, of the smooth surface, on the side that is seen.
    flat: FloatArray  #: ``(n, 3)`` unit, of the face, on that side.
    lifted: FloatArray  #: ``(n, 3)`` m, where a ray towards a light begins.
    albedo: FloatArray  #: ``(n, 3)`` linear.

    def __len__(self) -> int:
        return len(self.faces)


def places_seen(
    appearance: Appearance, faces: IntArray, weights: FloatArray, seen_along: FloatArray
) -> Places:
    """Places of a surface as an eye has them; both sides of a face are of its colour.

    Args:
        appearance: of the surface.
        faces: ``(n,)`` indices.
        weights: ``(n, 2)`` of the second and third corner.
        seen_along: ``(n, 3)`` from the eye to the places, of any length but zero.

    Raises:
        OutOfDomain: a face that there is not, or other than one view for each place.
    """
    appearance.require_faces(faces)
    if not len(faces) == len(weights) == len(seen_along):
        raise OutOfDomain(
            f"{len(faces)} faces, {len(weights)} weights and {len(seen_along)} views were given; "
            "give one of each"
        )
    mesh = appearance.mesh
    filled = [np.empty((len(faces), 3)) for _ in range(4)]
    faced_places(faces, weights, seen_along, mesh.corners, mesh.face_normals, appearance.normals, *filled)
    points, normals, flat, lifted = (read_only(each) for each in filled)
    return Places(faces, points, normals, flat, lifted, appearance.albedo(faces, weights))


def cosines(places: Places, towards: FloatArray, size: float) -> FloatArray:
    """``(n,)`` cosine between each place and what it faces, 0 where it faces away; nothing is in the way.

    Args:
        places: of the surface.
        towards: ``(n, 3)`` unit, or ``(1, 3)`` for all.
        size: m, of the object.
    """
    return lit_by(towards, places.points, places.normals, places.flat, places.lifted, size)


def radiance(places: Places, falling: FloatArray) -> FloatArray:
    """``(n, 3)`` linear light that leaves each place, to any side, of ``(n,)`` that falls on it."""
    return np.asarray(places.albedo * (falling / np.pi)[:, None])


@compiled
def faced_places(
    faces: IntArray,
    weights: FloatArray,
    seen_along: FloatArray,
    corners: FloatArray,
    face_normals: FloatArray,
    normals: FloatArray,
    points: FloatArray,
    facing: FloatArray,
    flat: FloatArray,
    lifted: FloatArray,
) -> None:
    """Fill in places of the surface, each on the side that is seen.

    A face stands for a part of a smooth surface that bulges out of it. ``lifted`` is on that surface,
    as far as its corners' tangent planes tell (Hanika, Hacking the shadow terminator, Ray Tracing Gems II,
    2021), so that no facet shades its neighbours where the surface would not.

    Args:
        faces: ``(n,)``.
        weights: ``(n, 2)`` of the second and third corner.
        seen_along: ``(n, 3)`` unit, from the eye; or ``(1, 3)`` for all.
        corners: ``(m, 3, 3)`` m.
        face_normals: ``(m, 3)`` unit, outward.
        normals: ``(m, 3, 3)`` unit, of the corners.
        points: ``(n, 3)`` m on the face, overwritten.
        facing: ``(n, 3)`` unit, smooth, towards the side that is seen; overwritten.
        flat: ``(n, 3)`` unit, the face's, towards that side; overwritten.
        lifted: ``(n, 3)`` m, overwritten.
    """
    one = len(seen_along) == 1
    for n in range(len(faces)):
        f, k, b, c = faces[n], 0 if one else n, weights[n, 0], weights[n, 1]
        view = (seen_along[k, 0], seen_along[k, 1], seen_along[k, 2])
        point, normal, own, above = place_on(f, b, c, view, corners, face_normals, normals)
        for x in range(3):
            points[n, x], facing[n, x], flat[n, x], lifted[n, x] = point[x], normal[x], own[x], above[x]


@compiled
def place_on(
    f: int,
    b: float,
    c: float,
    view: Three,
    corners: FloatArray,
    face_normals: FloatArray,
    normals: FloatArray,
) -> tuple[Three, Three, Three, Three]:
    """One place as ``faced_places`` fills it in: point, smooth normal, the face's normal, lifted.

    Whole arrays and single numbers: rows of arrays would cost more than what is done with them.
    """
    nx, ny, nz = face_normals[f, 0], face_normals[f, 1], face_normals[f, 2]
    side, a = -1.0 if view[0] * nx + view[1] * ny + view[2] * nz > 0.0 else 1.0, 1.0 - b - c
    flat = (side * nx, side * ny, side * nz)
    x = a * corners[f, 0, 0] + b * corners[f, 1, 0] + c * corners[f, 2, 0]
    y = a * corners[f, 0, 1] + b * corners[f, 1, 1] + c * corners[f, 2, 1]
    z = a * corners[f, 0, 2] + b * corners[f, 1, 2] + c * corners[f, 2, 2]
    nx = side * (a * normals[f, 0, 0] + b * normals[f, 1, 0] + c * normals[f, 2, 0])
    ny = side * (a * normals[f, 0, 1] + b * normals[f, 1, 1] + c * normals[f, 2, 1])
    nz = side * (a * normals[f, 0, 2] + b * normals[f, 1, 2] + c * normals[f, 2, 2])
    length = np.sqrt(nx**2 + ny**2 + nz**2)
    facing = (nx / length, ny / length, nz / length) if length > 0.0 else flat
    up_x, up_y, up_z = x, y, z
    for k in range(3):
        nx, ny, nz = side * normals[f, k, 0], side * normals[f, k, 1], side * normals[f, k, 2]
        below = (x - corners[f, k, 0]) * nx + (y - corners[f, k, 1]) * ny + (z - corners[f, k, 2]) * nz
        if below < 0.0:
            rise = -(a if k == 0 else (b if k == 1 else c)) * below
            up_x, up_y, up_z = up_x + rise * nx, up_y + rise * ny, up_z + rise * nz
    return (x, y, z), facing, flat, (up_x, up_y, up_z)


@compiled
def lit_by(
    lights: FloatArray,
    points: FloatArray,
    facing: FloatArray,
    flat: FloatArray,
    lifted: FloatArray,
    size: float,
) -> FloatArray:
    """``(n,)`` cosine between each place and a light that it faces, else 0.

    A place on its own face (not lifted) that looks away from the light as that face does is unlit, though
    its smooth normal may not say so yet: the face itself is in the light's way.

    Args:
        lights: ``(n, 3)`` unit, towards it; or ``(1, 3)`` for all.
        points: see ``faced_places``; and so are ``facing``, ``flat`` and ``lifted``.
        facing: see above.
        flat: see above.
        lifted: see above.
        size: m, of the object.
    """
    lit = np.empty(len(points))
    one = len(lights) == 1
    for n in range(len(points)):
        k = 0 if one else n
        lit[n] = cosine_of(
            (lights[k, 0], lights[k, 1], lights[k, 2]),
            (points[n, 0], points[n, 1], points[n, 2]),
            (facing[n, 0], facing[n, 1], facing[n, 2]),
            (flat[n, 0], flat[n, 1], flat[n, 2]),
            (lifted[n, 0], lifted[n, 1], lifted[n, 2]),
            size,
        )
    return lit


@compiled
def cosine_of(light: Three, point: Three, facing: Three, flat: Three, lifted: Three, size: float) -> float:
    """One place as ``lit_by`` fills it in."""
    cosine = facing[0] * light[0] + facing[1] * light[1] + facing[2] * light[2]
    if cosine <= 0.0:
        return 0.0
    if flat[0] * light[0] + flat[1] * light[1] + flat[2] * light[2] <= 0.0:
        up = (lifted[0] - point[0]) * flat[0] + (lifted[1] - point[1]) * flat[1]
        if up + (lifted[2] - point[2]) * flat[2] <= _LIFTED * size:
            return 0.0
    return float(cosine)
