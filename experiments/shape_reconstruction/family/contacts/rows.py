"""How a shape disagrees with its contacts: rows of points, of normals, of where the gel touched nothing."""

import numpy as np

from experiments.shape_reconstruction.family.distance import distance
from experiments.shape_reconstruction.family.layout import GEL
from experiments.shape_reconstruction.family.observed import FamilyEvidence
from harness.basics.arrays import FloatArray, IntArray
from harness.basics.compiled import compiled, inlined

NORMAL_STEP = 1.2e-3
"""M between the places of which a shape's normal is taken."""

CLEAR_SIGMA = 0.4e-3
"""M by which a shape that passes through a contact's points may seem to reach into the gel beside them: most
of what a contact is off by, all its places share."""

SHARED = 1.5e-3
"""M that a contact is off by as a whole, at most, where its places are compared with each other."""

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
    x, y, z = moved_by_gel(theta, seen.gel[j], seen.points[i])
    return float(distance(code, q, False, x, y, z) / seen.sigma[j])


@inlined
def moved_by_gel(theta: FloatArray, turn: FloatArray, point: FloatArray) -> tuple[float, float, float]:
    """Where a place of the sensor is, were the gel off by what the shape's vector says.

    Args:
        theta: ``(SIZE,)``.
        turn: ``(3, 3)`` stand from gel.
        point: ``(3,)`` m.
    """
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
    x, y, z = moved_by_gel(theta, seen.gel[j], seen.middles[j])
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
def contacts_off(seen: FamilyEvidence, points: FloatArray) -> FloatArray:
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
    """How deep the shape reaches into the gel where that touched nothing, were it moved to the contact."""
    j = seen.clear_touch[i]
    x, y, z = moved_by_gel(theta, seen.gel[j], seen.clear[i])
    return float(min(distance(code, q, False, x, y, z) - off[j], 0.0) / CLEAR_SIGMA)


@compiled
def weigh_contacts(seen: FamilyEvidence, robust: bool, values: FloatArray, weights: FloatArray) -> float:
    """Fill in the weights of the contacts' rows; returns what they cost. A contact counts as a whole."""
    sums = contact_sums(seen, values)
    first = len(seen.points) + 3 * len(seen.middles)
    for i in range(len(seen.clear)):
        j = seen.clear_touch[i]
        sums[j] += seen.clear_worth[j] * values[first + i] ** 2
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
        weights[i] = factor[seen.touch[i]] * seen.worth[seen.touch[i]]
    for i in range(len(seen.clear)):
        weights[first + i] = factor[seen.clear_touch[i]] * seen.clear_worth[seen.clear_touch[i]]
    return cost


@compiled
def contact_sums(seen: FamilyEvidence, values: FloatArray) -> FloatArray:
    """``(contacts,)`` sums of the squared residuals of what each touched, as independent as they are."""
    sums = np.zeros(len(seen.middles))
    n = len(seen.points)
    for i in range(n):
        sums[seen.touch[i]] += seen.worth[seen.touch[i]] * values[i] ** 2
    for j in range(len(sums)):
        for a in range(3):
            sums[j] += values[n + 3 * j + a] ** 2
    return sums
