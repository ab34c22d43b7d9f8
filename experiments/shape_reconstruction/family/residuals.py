"""How a shape of the family disagrees with the readings: weighted residuals, and the cost they add up to.

One likelihood for touch, sight and both: what was not read has no rows. Rows: of each contact its points, its
normal and the places where its gel touched nothing, every free place, every ray. A contact counts as a whole:
one that slipped loses all its weight.
"""

from typing import NamedTuple

import numpy as np

from experiments.shape_reconstruction.family.contact_rows import (
    clear_row,
    contact_row_count,
    contacts_off,
    normal_rows,
    point_row,
    weigh_contacts,
)
from experiments.shape_reconstruction.family.distance import PREPARED, ball, distance, inside_depth, prepare
from experiments.shape_reconstruction.family.layout import (
    CAMERA_DOWN,
    CAMERA_RIGHT,
    CAMERA_SCALE,
    OUTLINE,
)
from experiments.shape_reconstruction.family.observed import FamilyEvidence
from experiments.shape_reconstruction.family.ray_depth import nearest_along
from experiments.shape_reconstruction.family.sight import GRAZE, MEET, PASS
from harness.basics.arrays import FloatArray, IntArray
from harness.basics.compiled import compiled

FREE_SIGMA = 1.0e-3
"""M by which the sensor's housing may seem to be inside the object."""

RAY_MODEL = 0.5e-3
"""M by which the outline of the nearest shape is off a real one."""

PIXELS = 0.5
"""Of an outline's deviation: one standard deviation of where a mask ends."""

_BEND = 3.0
"""Standard deviations beyond which a ray or a free place costs in proportion, not its square."""


class Rows(NamedTuple):
    """Residuals in units of their standard deviations, and what they cost.

    Attributes:
        values: ``(rows,)``.
        weights: ``(rows,)`` by which a squared residual counts at this shape: worth times robustness.
        along: ``(rays,)`` m along each ray where the shape is nearest.
    """

    values: FloatArray
    weights: FloatArray
    along: FloatArray


@compiled
def row_count(seen: FamilyEvidence) -> int:
    """Rows of all readings: of contacts, free places, rays."""
    return int(contact_row_count(seen) + len(seen.free) + len(seen.rays.kinds))


@compiled
def evaluate(
    code: IntArray, theta: FloatArray, seen: FamilyEvidence, robust: bool, out: Rows, q: FloatArray
) -> float:
    """Fill in the rows of a shape; returns half the sum of what they cost.

    ``robust`` lets go of contacts that do not fit; without it they pull with at most a constant force.
    """
    prepare(code, theta, q)
    n, m, k = len(seen.points), len(seen.middles), len(seen.free)
    for i in range(n):
        out.values[i] = point_row(code, theta, seen, q, i)
    for j in range(m):
        normal_rows(code, theta, seen, q, j, out.values[n + 3 * j : n + 3 * j + 3])
    off = contacts_off(seen, out.values)
    for i in range(len(seen.clear)):
        out.values[n + 3 * m + i] = clear_row(code, theta, seen, q, off, i)
    cost = weigh_contacts(seen, robust, out.values, out.weights)
    first = contact_row_count(seen)
    for i in range(k):
        out.values[first + i] = _free(code, seen, q, i)
        cost += _weigh(first + i, 1.0, out)
    return cost + _evaluate_rays(code, theta, seen, out, q, first + k)


@compiled
def _evaluate_rays(
    code: IntArray, theta: FloatArray, seen: FamilyEvidence, out: Rows, q: FloatArray, first: int
) -> float:
    rays, cost = seen.rays, 0.0
    origin, towards, to_middle = np.empty(3), np.empty(3), np.empty(3)
    radius = ball(q, to_middle)
    for a in range(3):
        origin[a] = rays.eye[a] + theta[CAMERA_RIGHT] * rays.right[a] + theta[CAMERA_DOWN] * rays.down[a]
        to_middle[a] -= origin[a]
    for i in range(len(rays.kinds)):
        _turned_ray(theta, seen, i, towards)
        d, out.along[i] = nearest_along(
            code, q, origin, towards, radius, to_middle, rays.kinds[i] == MEET, rays.step
        )
        out.values[first + i] = _sighted(theta, seen, i, d)
        cost += _weigh(first + i, rays.worth[i], out)
    return cost


@compiled
def _turned_ray(theta: FloatArray, seen: FamilyEvidence, i: int, towards: FloatArray) -> None:
    """A ray's direction, were the picture's scale off by what the shape's vector says."""
    rays = seen.rays
    scale = theta[CAMERA_SCALE]
    for a in range(3):
        towards[a] = rays.directions[i, a] + scale * (rays.directions[i, a] - rays.middle[a])


@compiled
def _sighted(theta: FloatArray, seen: FamilyEvidence, i: int, d: float) -> float:
    """A ray's residual where it passes the shape at ``d`` m."""
    rays = seen.rays
    sigma = np.hypot(PIXELS * rays.pixel, RAY_MODEL)
    if rays.kinds[i] == GRAZE:
        return float((d - theta[OUTLINE]) / sigma)
    if rays.kinds[i] == PASS:
        return float(min(d, 0.0) * rays.gain[i] / sigma)
    return float(max(d, 0.0) / sigma)


@compiled
def _free(code: IntArray, seen: FamilyEvidence, q: FloatArray, i: int) -> float:
    p = seen.free[i]
    return float(inside_depth(code, q, p[0], p[1], p[2]) / FREE_SIGMA)


@compiled
def _weigh(row: int, worth: float, out: Rows) -> float:
    size = abs(out.values[row])
    if size <= _BEND:
        out.weights[row] = worth
        return float(0.5 * worth * size * size)
    out.weights[row] = worth * _BEND / size
    return float(worth * _BEND * (size - 0.5 * _BEND))


@compiled
def frozen(
    code: IntArray,
    theta: FloatArray,
    seen: FamilyEvidence,
    active: IntArray,
    along: FloatArray,
    q: FloatArray,
    out: FloatArray,
) -> None:
    """Fill in the residuals of some rows with the rays' nearest places held: what derivatives are taken of.

    A ray's least distance changes as that at its nearest place does (the envelope theorem).
    """
    prepare(code, theta, q)
    n, k = len(seen.points), len(seen.free)
    clear, first, rays = n + 3 * len(seen.middles), contact_row_count(seen), seen.rays
    towards, triple, last = np.empty(3), np.empty(3), -1
    off = np.empty(0)
    for row in range(len(active)):
        i = active[row]
        if i < n:
            out[row] = point_row(code, theta, seen, q, i)
        elif i < clear:
            j = (i - n) // 3
            if j != last:
                normal_rows(code, theta, seen, q, j, triple)
                last = j
            out[row] = triple[(i - n) % 3]
        elif i < first:
            if not len(off):
                off = contacts_off(seen, out)  # all points are active: their rows are the first
            out[row] = clear_row(code, theta, seen, q, off, i - clear)
        elif i < first + k:
            out[row] = _free(code, seen, q, i - first)
        else:
            i -= first + k
            _turned_ray(theta, seen, i, towards)
            t = along[i]
            x, y, z = (
                rays.eye[0] + theta[CAMERA_RIGHT] * rays.right[0] + theta[CAMERA_DOWN] * rays.down[0],
                rays.eye[1] + theta[CAMERA_RIGHT] * rays.right[1] + theta[CAMERA_DOWN] * rays.down[1],
                rays.eye[2] + theta[CAMERA_RIGHT] * rays.right[2] + theta[CAMERA_DOWN] * rays.down[2],
            )
            d = distance(code, q, True, x + t * towards[0], y + t * towards[1], z + t * towards[2])
            out[row] = _sighted(theta, seen, i, d)


@compiled
def active_rows(seen: FamilyEvidence, values: FloatArray) -> IntArray:
    """Rows that pull: all of points, normals and grazing rays, and of the others those that are violated."""
    first = len(seen.points) + 3 * len(seen.middles)
    rays = contact_row_count(seen) + len(seen.free)
    found = np.empty(len(values), np.int64)
    count = 0
    for i in range(len(values)):
        if i < first or values[i] != 0.0 or (i >= rays and seen.rays.kinds[i - rays] == GRAZE):
            found[count] = i
            count += 1
    return found[:count]


@compiled
def rows_for(seen: FamilyEvidence) -> Rows:
    """Room for the rows of some readings."""
    count = row_count(seen)
    return Rows(np.zeros(count), np.zeros(count), np.zeros(len(seen.rays.kinds)))


@compiled
def prepared_room() -> FloatArray:
    """Room for a shape's prepared numbers."""
    return np.empty(PREPARED)
