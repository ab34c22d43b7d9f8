"""Places of a surface as light and eye have them: where they are, and which way they face."""

import numpy as np

from harness.arrays import FloatArray, IntArray
from harness.sim.compiled import compiled

_LIFTED = 1e-9
"""Shares of a face's size: a place lifted by less lies on its face."""


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
    toward = np.empty(3)
    for n in range(len(faces)):
        f = faces[n]
        view = seen_along[0 if one else n]
        away = view[0] * face_normals[f, 0] + view[1] * face_normals[f, 1] + view[2] * face_normals[f, 2]
        side = -1.0 if away > 0.0 else 1.0
        b, c = weights[n, 0], weights[n, 1]
        shares = (1.0 - b - c, b, c)
        for x in range(3):
            points[n, x] = shares[0] * corners[f, 0, x] + b * corners[f, 1, x] + c * corners[f, 2, x]
            facing[n, x] = side * (shares[0] * normals[f, 0, x] + b * normals[f, 1, x] + c * normals[f, 2, x])
            flat[n, x] = side * face_normals[f, x]
            lifted[n, x] = points[n, x]
        length = np.sqrt(facing[n, 0] ** 2 + facing[n, 1] ** 2 + facing[n, 2] ** 2)
        for x in range(3):
            facing[n, x] = facing[n, x] / length if length > 0.0 else flat[n, x]
        for k in range(3):
            below = 0.0
            for x in range(3):
                toward[x] = side * normals[f, k, x]
                below += (points[n, x] - corners[f, k, x]) * toward[x]
            if below < 0.0:
                for x in range(3):
                    lifted[n, x] -= shares[k] * below * toward[x]


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
    lit = np.zeros(len(points))
    one = len(lights) == 1
    for n in range(len(points)):
        light = lights[0 if one else n]
        cosine = facing[n, 0] * light[0] + facing[n, 1] * light[1] + facing[n, 2] * light[2]
        if cosine <= 0.0:
            continue
        if flat[n, 0] * light[0] + flat[n, 1] * light[1] + flat[n, 2] * light[2] <= 0.0:
            up = (lifted[n, 0] - points[n, 0]) * flat[n, 0]
            up += (lifted[n, 1] - points[n, 1]) * flat[n, 1]
            up += (lifted[n, 2] - points[n, 2]) * flat[n, 2]
            if up <= _LIFTED * size:
                continue
        lit[n] = cosine
    return lit
