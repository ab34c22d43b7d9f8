"""How a shape of the family disagrees with the readings: weighted residuals, and the cost they add up to.

One likelihood for touch, sight and both: what was not read has no rows. Rows: of each contact its points, its
normal and the places where its gel touched nothing, every housing that met it, every free place, every ray,
every place that is supposed. A contact counts as a whole: one that slipped loses all its weight.
"""

from typing import NamedTuple

import numpy as np

from experiments.shape_reconstruction.family.contacts.housing import housing_row
from experiments.shape_reconstruction.family.contacts.rows import (
    clear_row,
    contact_row_count,
    contacts_off,
    normal_rows,
    point_row,
    weigh_contacts,
)
from experiments.shape_reconstruction.family.distance import PREPARED, ball, distance, inside_depth, prepare
from experiments.shape_reconstruction.family.layout import CAMERA_DOWN, CAMERA_RIGHT
from experiments.shape_reconstruction.family.observed import FamilyEvidence
from experiments.shape_reconstruction.family.ray_depth import nearest_along
from experiments.shape_reconstruction.family.ray_rows import ray_origin, sighted, turned_ray
from experiments.shape_reconstruction.family.sight import MEET
from harness.basics.arrays import FloatArray, IntArray
from harness.basics.compiled import compiled, inlined

FREE_SIGMA = 1.0e-3
"""M by which the sensor's housing may seem to be inside the object."""

SUPPOSED_SIGMA = 5.0e-3
"""M by which a place that is supposed is off: a little more than a glance is on shapes held out."""

_BEND = 3.0
"""Standard deviations beyond which a ray, a free or a supposed place costs in proportion, not its square."""


class Rows(NamedTuple):
    """Residuals in units of their standard deviations, and what they cost.

    Attributes:
        values: ``(rows,)``.
        weights: ``(rows,)`` by which a squared residual counts at this shape: worth times robustness.
        along: ``(rays,)`` m along each ray where the shape is nearest.
        held: ``(rays, 3)`` where each is held as derivatives are taken: two places, m, the second's share.
        met: ``(faces, 3)`` m, the place of each housing's face that is nearest to the shape.
    """

    values: FloatArray
    weights: FloatArray
    along: FloatArray
    held: FloatArray
    met: FloatArray


@compiled
def row_count(seen: FamilyEvidence) -> int:
    """Rows of all readings: of contacts, housings, free places, rays, and of what is supposed."""
    return int(first_supposed(seen) + len(seen.supposed))


@compiled
def first_ray(seen: FamilyEvidence) -> int:
    """Row of the first ray."""
    return int(contact_row_count(seen) + len(seen.faces) + len(seen.free))


@compiled
def first_supposed(seen: FamilyEvidence) -> int:
    """Row of the first place that is supposed."""
    return int(first_ray(seen) + len(seen.rays.kinds))


@compiled
def evaluate(
    code: IntArray,
    theta: FloatArray,
    seen: FamilyEvidence,
    robust: bool,
    out: Rows,
    q: FloatArray,
    most: float = np.inf,
) -> float:
    """Fill in the rows of a shape; returns half the sum of what they cost.

    Args:
        code: of the shape.
        theta: ``(SIZE,)``.
        seen: readings.
        robust: lets go of contacts that do not fit; without it they pull with at most a constant force.
        out: to fill in.
        q: room.
        most: a shape that costs more is not asked for: as soon as its rows come to more, infinity is
            returned, and ``out`` is filled in part.
    """
    prepare(code, theta, q)
    n, m = len(seen.points), len(seen.middles)
    for i in range(n):
        out.values[i] = point_row(code, theta, seen, q, i)
    for j in range(m):
        normal_rows(code, theta, seen, q, j, out.values[n + 3 * j : n + 3 * j + 3])
    off = contacts_off(seen, out.values)
    for i in range(len(seen.clear)):
        out.values[n + 3 * m + i] = clear_row(code, theta, seen, q, off, i)
    cost = weigh_contacts(seen, robust, out.values, out.weights)
    first = contact_row_count(seen)
    for i in range(len(seen.faces)):
        out.values[first + i] = housing_row(code, theta, seen, q, i, out.met[i])
        cost += _weigh(first + i, 1.0, out)
    if cost > most:
        return np.inf
    first += len(seen.faces)
    for i in range(len(seen.free)):
        out.values[first + i] = free_row(code, seen, q, i)
        cost += _weigh(first + i, 1.0, out)
    cost += _evaluate_rays(code, theta, seen, out, q, most - cost)
    if cost > most:
        return np.inf
    for i in range(len(seen.supposed)):
        row = first_supposed(seen) + i
        out.values[row] = supposed_row(code, theta, seen, q, i)
        cost += _weigh(row, seen.supposed_worth, out)
    return cost


@compiled
def _evaluate_rays(
    code: IntArray, theta: FloatArray, seen: FamilyEvidence, out: Rows, q: FloatArray, most: float
) -> float:
    rays, first, cost = seen.rays, first_ray(seen), 0.0
    origin, towards, to_middle = np.empty(3), np.empty(3), np.empty(3)
    radius = ball(q, to_middle)
    ray_origin(theta, rays, origin)
    to_middle -= origin
    for i in range(len(rays.kinds)):
        turned_ray(theta, rays, i, towards)
        d, out.along[i] = nearest_along(
            code, q, origin, towards, radius, to_middle, rays.kinds[i] == MEET, rays.step
        )
        out.values[first + i] = sighted(theta, rays, i, d)
        cost += _weigh(first + i, rays.worth[i], out)
        if cost > most:
            return np.inf
    return cost


@compiled
def free_row(code: IntArray, seen: FamilyEvidence, q: FloatArray, i: int) -> float:
    """How deep a place is in the shape where the sensor was, in standard deviations; zero outside."""
    p = seen.free[i]
    return float(inside_depth(code, q, p[0], p[1], p[2]) / FREE_SIGMA)


@inlined
def supposed_row(code: IntArray, theta: FloatArray, seen: FamilyEvidence, q: FloatArray, i: int) -> float:
    """A place on the support is supposed where the camera sees it, and is off by what the camera is."""
    p = seen.supposed[i]
    x, y, z = (
        p[0] + theta[CAMERA_RIGHT] * seen.supposed_right[0] + theta[CAMERA_DOWN] * seen.supposed_down[0],
        p[1] + theta[CAMERA_RIGHT] * seen.supposed_right[1] + theta[CAMERA_DOWN] * seen.supposed_down[1],
        p[2] + theta[CAMERA_RIGHT] * seen.supposed_right[2] + theta[CAMERA_DOWN] * seen.supposed_down[2],
    )
    return float(distance(code, q, False, x, y, z) / SUPPOSED_SIGMA)


@compiled
def _weigh(row: int, worth: float, out: Rows) -> float:
    size = abs(out.values[row])
    if size <= _BEND:
        out.weights[row] = worth
        return float(0.5 * worth * size * size)
    out.weights[row] = worth * _BEND / size
    return float(worth * _BEND * (size - 0.5 * _BEND))


@compiled
def rows_for(seen: FamilyEvidence) -> Rows:
    """Room for the rows of some readings."""
    count = row_count(seen)
    rays = len(seen.rays.kinds)
    met = np.zeros((len(seen.faces), 3))
    return Rows(np.zeros(count), np.zeros(count), np.zeros(rays), np.zeros((rays, 3)), met)


@compiled
def prepared_room() -> FloatArray:
    """Room for a shape's prepared numbers."""
    return np.empty(PREPARED)
