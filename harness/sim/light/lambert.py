"""Matt surfaces under light from far away: exact at every place, in linear light."""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import BoolArray, FloatArray, IntArray, read_only
from harness.basics.errors import OutOfDomain
from harness.basics.faces.ray_mesh import RayMesh
from harness.picture.pinhole import DirectionalLight
from harness.sim.light.appearance import Appearance
from harness.sim.light.lambert_kernels import faced_places, lit_by


@dataclass(frozen=True, eq=False)
class Places:
    """Places of a surface, each on the side that is seen.

    Attributes:
        faces: ``(n,)`` indices.
        points: ``(n, 3)`` m, in the object's frame.
        normals: ``(n, 3)`` unit, of the smooth surface, on the side that is seen.
        flat: ``(n, 3)`` unit, of the face, on that side.
        lifted: ``(n, 3)`` m, where a ray towards a light begins.
        albedo: ``(n, 3)`` linear.
    """

    faces: IntArray
    points: FloatArray
    normals: FloatArray
    flat: FloatArray
    lifted: FloatArray
    albedo: FloatArray

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


def irradiance(places: Places, light: DirectionalLight, size: float) -> FloatArray:
    """``(n,)`` what falls on each place where nothing is in the light's way.

    Args:
        places: of the surface.
        light: from far away.
        size: m, of the object.
    """
    return light.irradiance * cosines(places, light.direction[None], size)


def cosines(places: Places, towards: FloatArray, size: float) -> FloatArray:
    """``(n,)`` cosine between each place and what it faces, 0 where it faces away; nothing is in the way.

    Args:
        places: of the surface.
        towards: ``(n, 3)`` unit, or ``(1, 3)`` for all.
        size: m, of the object.
    """
    return lit_by(towards, places.points, places.normals, places.flat, places.lifted, size)


def sees_light(rays: RayMesh, places: Places, light: DirectionalLight, asked: BoolArray) -> BoolArray:
    """Whether nothing is between each place and the light.

    Args:
        rays: of the same surface.
        places: of the surface.
        light: from far away.
        asked: ``(n,)`` the places that it matters for; False is answered for the others.
    """
    free = np.zeros(len(places), np.bool_)
    free[asked] = rays.free(places.lifted[asked], light.direction, places.faces[asked])
    return free


def radiance(places: Places, falling: FloatArray) -> FloatArray:
    """``(n, 3)`` linear light that leaves each place, to any side, of ``(n,)`` that falls on it."""
    return np.asarray(places.albedo * (falling / np.pi)[:, None])
