"""How a shape disagrees with ways that the sensor's housing ended: it touches the housing's face somewhere.

Where is not known. It is the place of the face that lies nearest to the shape, or deepest within it.
"""

import numpy as np

from experiments.shape_reconstruction.family.contacts.rows import moved_by_gel
from experiments.shape_reconstruction.family.distance import distance
from experiments.shape_reconstruction.family.layout import GEL
from experiments.shape_reconstruction.family.observed import FamilyEvidence
from harness.basics.arrays import FloatArray, IntArray
from harness.basics.compiled import compiled

_ACROSS = 4
"""Places along each side of the face among which the nearest one is looked for at first."""

_HALVINGS = 4
"""Times that the step to its neighbours is halved then: it is known to half a millimetre."""


@compiled
def nearest_on_face(code: IntArray, q: FloatArray, face: FloatArray, place: FloatArray) -> float:
    """The least signed distance of a shape from a rectangle, m.

    Args:
        code: of the shape.
        q: its prepared numbers.
        face: ``(3, 3)`` m: the middle of the rectangle, and from there half of either side.
        place: ``(3,)``, filled in: where it is, m.
    """
    best, a, b = np.inf, 0.0, 0.0
    for i in range(_ACROSS):
        for j in range(_ACROSS):
            u, v = (2 * i + 1.0) / _ACROSS - 1.0, (2 * j + 1.0) / _ACROSS - 1.0
            d = _at(code, q, face, u, v)
            if d < best:
                best, a, b = d, u, v
    step = 1.0 / _ACROSS
    for _ in range(_HALVINGS):
        for k in range(4):
            u = min(max(a + step * ((k == 0) - (k == 1)), -1.0), 1.0)
            v = min(max(b + step * ((k == 2) - (k == 3)), -1.0), 1.0)
            d = _at(code, q, face, u, v)
            if d < best:
                best, a, b = d, u, v
        step *= 0.5
    place[:] = face[0] + a * face[1] + b * face[2]
    return float(best)


@compiled
def _at(code: IntArray, q: FloatArray, face: FloatArray, a: float, b: float) -> float:
    x = face[0, 0] + a * face[1, 0] + b * face[2, 0]
    y = face[0, 1] + a * face[1, 1] + b * face[2, 1]
    z = face[0, 2] + a * face[1, 2] + b * face[2, 2]
    return float(distance(code, q, False, x, y, z))


@compiled
def housing_row(
    code: IntArray, theta: FloatArray, seen: FamilyEvidence, q: FloatArray, i: int, place: FloatArray
) -> float:
    """Distance of a shape from the face that met it, in standard deviations; ``place`` is filled in."""
    moved = seen.faces[i].copy()
    moved[0] += seen.face_gel[i] @ theta[GEL : GEL + 3]
    off = nearest_on_face(code, q, moved, place)
    place -= moved[0] - seen.faces[i, 0]
    return float(off / seen.face_sigma[i])


@compiled
def held_housing_row(
    code: IntArray, theta: FloatArray, seen: FamilyEvidence, q: FloatArray, i: int, place: FloatArray
) -> float:
    """The same where the place that touches is held on the face."""
    x, y, z = moved_by_gel(theta, seen.face_gel[i], place)
    return float(distance(code, q, False, x, y, z) / seen.face_sigma[i])
