"""How a shape of the family disagrees with the readings: weighted residuals, and the cost they add up to.

One likelihood for touch, sight and both: what was not read has no rows. Rows: of each contact its points, its
normal and the places where its gel touched nothing, every housing that met it, every free place, every ray,
every place that is supposed. A contact counts as a whole: one that slipped loses all its weight.
"""

from typing import NamedTuple

import numpy as np

from experiments.shape_reconstruction.family.contacts.housing import held_housing_row, housing_row
from experiments.shape_reconstruction.family.contacts.rows import (
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
    GEL,
    OUTLINE,
    POSE_END,
)
from experiments.shape_reconstruction.family.observed import FamilyEvidence
from experiments.shape_reconstruction.family.ray_depth import nearest_along
from experiments.shape_reconstruction.family.ray_rows import (
    held_distance,
    hold_ray,
    ray_origin,
    sighted,
    turned_ray,
)
from experiments.shape_reconstruction.family.sight import GRAZE, MEET
from harness.basics.arrays import FloatArray, IntArray
from harness.basics.compiled import compiled

FREE_SIGMA = 1.0e-3
"""M by which the sensor's housing may seem to be inside the object."""

SUPPOSED_SIGMA = 5.0e-3
"""M by which a place that is supposed is off: a little more than a glance is on shapes held out."""

_BEND = 3.0
"""Standard deviations beyond which a ray, a free or a supposed place costs in proportion, not its square."""


ALL, OF_TOUCH, OF_SIGHT = 0, 1, 2
"""Rows: of every reading, of contacts, and of rays and of what is supposed by the picture."""


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
    return int(_first_supposed(seen) + len(seen.supposed))


@compiled
def _first_ray(seen: FamilyEvidence) -> int:
    return int(contact_row_count(seen) + len(seen.faces) + len(seen.free))


@compiled
def _first_supposed(seen: FamilyEvidence) -> int:
    return int(_first_ray(seen) + len(seen.rays.kinds))


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
        most: a shape that costs more is not asked for: where its rows come to more, that is returned, and
            ``out`` is filled in part.
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
        return cost
    first += len(seen.faces)
    for i in range(len(seen.free)):
        out.values[first + i] = _free(code, seen, q, i)
        cost += _weigh(first + i, 1.0, out)
    cost += _evaluate_rays(code, theta, seen, out, q, most - cost)
    if cost > most:
        return cost
    for i in range(len(seen.supposed)):
        row = _first_supposed(seen) + i
        out.values[row] = _supposed(code, theta, seen, q, i)
        cost += _weigh(row, seen.supposed_worth, out)
    return cost


@compiled
def _evaluate_rays(
    code: IntArray, theta: FloatArray, seen: FamilyEvidence, out: Rows, q: FloatArray, most: float
) -> float:
    rays, first, cost = seen.rays, _first_ray(seen), 0.0
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
            break
    return cost


@compiled
def _free(code: IntArray, seen: FamilyEvidence, q: FloatArray, i: int) -> float:
    p = seen.free[i]
    return float(inside_depth(code, q, p[0], p[1], p[2]) / FREE_SIGMA)


@compiled
def _supposed(code: IntArray, theta: FloatArray, seen: FamilyEvidence, q: FloatArray, i: int) -> float:
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
def hold_rays(
    code: IntArray, theta: FloatArray, seen: FamilyEvidence, active: IntArray, out: Rows, q: FloatArray
) -> None:
    """Fill in where rays are held, ``out.held``, of those that are active."""
    prepare(code, theta, q)
    first, rays = _first_ray(seen), seen.rays
    origin, towards = np.empty(3), np.empty(3)
    ray_origin(theta, rays, origin)
    for row in active:
        i = row - first
        if 0 <= i < len(rays.kinds):
            turned_ray(theta, rays, i, towards)
            hold_ray(code, q, origin, towards, out.along[i], rays.step, out.held[i])


@compiled
def frozen(
    code: IntArray,
    theta: FloatArray,
    seen: FamilyEvidence,
    active: IntArray,
    held: Rows,
    which: int,
    q: FloatArray,
    out: FloatArray,
) -> None:
    """Fill in the residuals of some rows with rays and housings held in place: what derivatives are taken of.

    Args:
        code: of the shape.
        theta: ``(SIZE,)``.
        seen: readings.
        active: rows, ascending.
        held: where, as ``evaluate`` and ``hold_rays`` leave it.
        which: of those rows ``ALL`` are filled in, or only ``OF_TOUCH`` or ``OF_SIGHT``.
        q: room.
        out: ``(active,)``.
    """
    prepare(code, theta, q)
    n, first, ray = len(seen.points), contact_row_count(seen), _first_ray(seen)
    clear, free, rays = n + 3 * len(seen.middles), first + len(seen.faces), seen.rays
    towards, origin, triple, last = np.empty(3), np.empty(3), np.empty(3), -1
    ray_origin(theta, rays, origin)
    off = np.empty(0)
    for row in range(len(active)):
        i = active[row]
        if (which == OF_SIGHT and i < ray) or (which == OF_TOUCH and i >= free):
            continue
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
        elif i < free:
            out[row] = held_housing_row(code, theta, seen, q, i - first, held.met[i - first])
        elif i < ray:
            out[row] = _free(code, seen, q, i - free)
        elif i >= _first_supposed(seen):
            out[row] = _supposed(code, theta, seen, q, i - _first_supposed(seen))
        else:
            i -= ray
            turned_ray(theta, rays, i, towards)
            d = held_distance(code, q, origin, towards, held.held[i])
            out[row] = sighted(theta, rays, i, d)


@compiled
def moved_rows(direction: FloatArray) -> int:
    """Which rows a ``(SIZE,)`` direction changes: the camera's errors move no contact, the gel's no ray."""
    camera, gel, others = False, False, False
    for i in range(len(direction)):
        if direction[i] != 0.0:
            if CAMERA_RIGHT <= i <= OUTLINE:
                camera = True
            elif GEL <= i < POSE_END:
                gel = True
            else:
                others = True
    if others or (camera and gel):
        return ALL
    return OF_SIGHT if camera else OF_TOUCH


@compiled
def active_rows(seen: FamilyEvidence, values: FloatArray) -> IntArray:
    """Rows that pull: of points, normals, housings and grazing rays all, of the others those not zero."""
    first, end = len(seen.points) + 3 * len(seen.middles), _first_supposed(seen)
    rays = _first_ray(seen)
    found = np.empty(len(values), np.int64)
    count = 0
    for i in range(len(values)):
        if i < first or values[i] != 0.0 or (rays <= i < end and seen.rays.kinds[i - rays] == GRAZE):
            found[count] = i
            count += 1
    return found[:count]


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
