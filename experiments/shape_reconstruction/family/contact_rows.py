"""Residuals of contacts: points, normals, places where the gel touched nothing, and housings in contact.

A housing touches the shape at an unknown place of its face: the place nearest to the shape, or deepest
within.
"""

import numpy as np

from experiments.shape_reconstruction.family.distance import distance
from experiments.shape_reconstruction.family.layout import GEL
from experiments.shape_reconstruction.family.observed import FamilyEvidence
from harness.basics.arrays import FloatArray, IntArray
from harness.basics.compiled import compiled, inlined

NORMAL_STEP = 1.2e-3
"""Step of a shape's normal, m."""

CLEAR_SIGMA = 0.4e-3
"""Standard deviation of a clear point, m: most of a contact's error is shared by all its points."""

SHARED = 1.5e-3
"""Largest error of a contact as a whole where its points are compared with each other, m."""

SLIPPED = 12.0
"""A contact's sum of squares at which it has half its weight."""


@compiled
def contact_row_count(seen: FamilyEvidence) -> int:
    """Rows of all contacts: points, three to a normal, places that touched nothing, in this order."""
    return int(len(seen.points) + 3 * len(seen.middles) + len(seen.clear))


@inlined
def point_row(code: IntArray, theta: FloatArray, seen: FamilyEvidence, q: FloatArray, i: int) -> float:
    """Distance of a touched point from the shape, in standard deviations."""
    j = seen.touch[i]
    x, y, z = shift_by_gel(theta, seen.gel[j], seen.points[i])
    return float(distance(code, q, False, x, y, z) / seen.sigma[j])


@inlined
def shift_by_gel(theta: FloatArray, turn: FloatArray, point: FloatArray) -> tuple[float, float, float]:
    """Shift a point by the gel's offset in a shape's vector; ``turn`` is ``(3, 3)``, stand from gel."""
    a, b, c = theta[GEL], theta[GEL + 1], theta[GEL + 2]
    x = point[0] + turn[0, 0] * a + turn[0, 1] * b + turn[0, 2] * c
    y = point[1] + turn[1, 0] * a + turn[1, 1] * b + turn[1, 2] * c
    z = point[2] + turn[2, 0] * a + turn[2, 1] * b + turn[2, 2] * c
    return x, y, z


@inlined
def normal_rows(
    code: IntArray, theta: FloatArray, seen: FamilyEvidence, q: FloatArray, j: int, out: FloatArray
) -> None:
    """The gradient just outside a contact less its normal; four places give it."""
    x, y, z = shift_by_gel(theta, seen.gel[j], seen.middles[j])
    h = NORMAL_STEP
    n = seen.normals[j]
    x, y, z = x + h * n[0], y + h * n[1], z + h * n[2]
    a = distance(code, q, False, x + h, y - h, z - h)
    b = distance(code, q, False, x - h, y - h, z + h)
    c = distance(code, q, False, x - h, y + h, z - h)
    d = distance(code, q, False, x + h, y + h, z + h)
    scale = 0.25 / h
    out[0] = ((a - b - c + d) * scale - n[0]) / seen.normal_sigma[j]
    out[1] = ((-a - b + c + d) * scale - n[1]) / seen.normal_sigma[j]
    out[2] = ((-a + b - c + d) * scale - n[2]) / seen.normal_sigma[j]


@compiled
def contact_offsets(seen: FamilyEvidence, points: FloatArray) -> FloatArray:
    """``(contacts,)`` m that each lies outside of the shape as a whole, by the rows of its points."""
    off, count = np.zeros(len(seen.middles)), np.zeros(len(seen.middles))
    for i in range(len(seen.points)):
        j = seen.touch[i]
        off[j] += points[i] * seen.sigma[j]
        count[j] += 1.0
    return np.minimum(np.maximum(off / np.maximum(count, 1.0), -SHARED), SHARED)


@inlined
def clear_row(
    code: IntArray, theta: FloatArray, seen: FamilyEvidence, q: FloatArray, off: FloatArray, i: int
) -> float:
    """Compute the depth of the shape in the gel at a clear point, once it is moved to the contact."""
    j = seen.clear_touch[i]
    x, y, z = shift_by_gel(theta, seen.gel[j], seen.clear[i])
    return float(min(distance(code, q, False, x, y, z) - off[j], 0.0) / CLEAR_SIGMA)


@compiled
def weigh_contacts(seen: FamilyEvidence, robust: bool, values: FloatArray, weights: FloatArray) -> float:
    """Fill in the weights of the contacts' rows; returns what they cost. A contact counts as a whole."""
    sums = contact_sums(seen, values)
    first = len(seen.points) + 3 * len(seen.middles)
    for i in range(len(seen.clear)):
        j = seen.clear_touch[i]
        sums[j] += seen.clear_weight[j] * values[first + i] ** 2
    cost = 0.0
    n = len(seen.points)
    factor = np.empty(len(sums))
    for j in range(len(sums)):
        s = sums[j]
        if robust:
            cost += 0.5 * SLIPPED * np.log(1.0 + s / SLIPPED)
            factor[j] = SLIPPED / (SLIPPED + s)
        elif s <= SLIPPED:
            cost += 0.5 * s
            factor[j] = 1.0
        else:
            cost += np.sqrt(SLIPPED * s) - 0.5 * SLIPPED
            factor[j] = np.sqrt(SLIPPED / s)
        weights[n + 3 * j : n + 3 * j + 3] = factor[j]
    for i in range(n):
        weights[i] = factor[seen.touch[i]] * seen.weight[seen.touch[i]]
    for i in range(len(seen.clear)):
        weights[first + i] = factor[seen.clear_touch[i]] * seen.clear_weight[seen.clear_touch[i]]
    return cost


@compiled
def contact_sums(seen: FamilyEvidence, values: FloatArray) -> FloatArray:
    """``(contacts,)`` sums of the squared residuals of what each touched, as independent as they are."""
    sums = np.zeros(len(seen.middles))
    n = len(seen.points)
    for i in range(n):
        sums[seen.touch[i]] += seen.weight[seen.touch[i]] * values[i] ** 2
    for j in range(len(sums)):
        for a in range(3):
            sums[j] += values[n + 3 * j + a] ** 2
    return sums


_ACROSS = 4
"""Places along each side of the face among which the nearest one is looked for at first."""

_HALVINGS = 4
"""Times that the step to its neighbours is halved then: it is known to half a millimetre."""


@compiled
def nearest_on_face(code: IntArray, q: FloatArray, face: FloatArray, place: FloatArray) -> float:
    """Find the least signed distance of a shape from a rectangle, m, and fill in its place.

    ``face`` is ``(3, 3)`` m: the middle of the rectangle, and from there half of either side.
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
