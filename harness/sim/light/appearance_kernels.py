"""The loops over faces and texels of an appearance."""

import numpy as np

from harness.basics.arrays import ByteArray, FloatArray, IntArray
from harness.basics.compiled import compiled


@compiled
def smoothed_normals(
    at: IntArray,
    faces_at: IntArray,
    starts: IntArray,
    normals: FloatArray,
    weights: FloatArray,
    least_cosine: float,
) -> FloatArray:
    """Mean normals at every face's corners.

    Args:
        at: ``(m, 3)`` the place of each corner.
        faces_at: faces by place: place p has those of ``starts[p]`` to ``starts[p + 1]``.
        starts: ``(places + 1,)``.
        normals: ``(m, 3)`` unit, of faces.
        weights: ``(m, 3)`` how much a face counts at each of its corners.
        least_cosine: of the angle between two faces that are one surface.

    Returns:
        ``(m, 3, 3)`` unit; the face's own where the mean has no direction.
    """
    smooth = np.empty((len(at), 3, 3))
    for f in range(len(at)):
        for corner in range(3):
            total = np.zeros(3)
            place = at[f, corner]
            for k in range(starts[place], starts[place + 1]):
                g = faces_at[k]
                if g != f and np.sum(normals[f] * normals[g]) < least_cosine:
                    continue
                for other in range(3):
                    if at[g, other] == place:
                        total += weights[g, other] * normals[g]
            length = np.sqrt(np.sum(total * total))
            smooth[f, corner] = total / length if length > 0.0 else normals[f]
    return smooth


@compiled
def albedo_at(
    faces: IntArray,
    weights: FloatArray,
    tints: FloatArray,
    places: FloatArray,
    texture_of: IntArray,
    texels: ByteArray,
    table: IntArray,
    linear: FloatArray,
) -> FloatArray:
    """Tint times texture at places of the surface; see ``Appearance``.

    Args:
        faces: ``(n,)``.
        weights: ``(n, 2)`` of the second and third corner.
        tints: of the appearance, and so are ``places`` and ``texture_of``.
        places: see ``Appearance``.
        texture_of: see ``Appearance``.
        texels: ``(texels, 3)`` of all textures, one after the other.
        table: ``(textures, 3)`` first texel, rows, columns.
        linear: ``(256,)`` light of each grey level.

    Returns:
        ``(n, 3)`` linear.
    """
    out = np.empty((len(faces), 3))
    for n in range(len(faces)):
        f = faces[n]
        b, c = weights[n, 0], weights[n, 1]
        a = 1.0 - b - c
        for channel in range(3):
            out[n, channel] = a * tints[f, 0, channel] + b * tints[f, 1, channel] + c * tints[f, 2, channel]
        texture = texture_of[f]
        if texture >= 0:
            u = a * places[f, 0, 0] + b * places[f, 1, 0] + c * places[f, 2, 0]
            v = a * places[f, 0, 1] + b * places[f, 1, 1] + c * places[f, 2, 1]
            _tint(out[n], u, v, texels, table[texture], linear)
    return out


@compiled
def _tint(
    colour: FloatArray, u: float, v: float, texels: ByteArray, where: IntArray, linear: FloatArray
) -> None:
    """Multiply by the texture at (u, v): between the four nearest texel centres, repeated beyond the edge."""
    first, rows, columns = where
    x = (u - np.floor(u)) * columns - 0.5
    y = (1.0 - (v - np.floor(v))) * rows - 0.5
    left, top = int(np.floor(x)), int(np.floor(y))
    right_share, low_share = x - left, y - top
    for channel in range(3):
        total = 0.0
        for i in range(2):
            row = (top + i) % rows
            for j in range(2):
                texel = first + row * columns + (left + j) % columns
                share = (low_share if i else 1.0 - low_share) * (right_share if j else 1.0 - right_share)
                total += share * linear[texels[texel, channel]]
        colour[channel] *= total
