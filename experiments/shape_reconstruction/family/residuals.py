"""Weighted residuals of a shape against the readings, and their cost.

One likelihood for touch, sight and both: what was not read has no rows. Rows: of each contact its points, its
normal and the places where its gel touched nothing, every housing that met it, every free place, every ray,
every point of the single-view prior. A contact counts as a whole: one that slipped loses all its weight.

Kernels share arguments: ``code`` and ``theta``, a shape; ``seen``, the readings; ``q``, a buffer for the
shape's prepared numbers; ``out``, the rows to fill in.
"""

from typing import NamedTuple

import numpy as np

from experiments.shape_reconstruction.family.contact_rows import (
    clear_row,
    contact_offsets,
    contact_row_count,
    housing_row,
    normal_rows,
    point_row,
    shift_by_gel,
    weigh_contacts,
)
from experiments.shape_reconstruction.family.distance import ball, distance, inside_depth, prepare
from experiments.shape_reconstruction.family.layout import (
    CAMERA_DOWN,
    CAMERA_RIGHT,
    CAMERA_SCALE,
    GEL,
    LIFT,
    OUTLINE,
    PREPARED,
    X,
    Y,
)
from experiments.shape_reconstruction.family.observed import GRAZE, MEET, FamilyEvidence
from experiments.shape_reconstruction.family.rays import (
    held_distance,
    hold_ray,
    nearest_along,
    ray_direction,
    ray_origin,
    ray_residual,
    ray_sigma,
)
from harness.basics.arrays import FloatArray, IntArray
from harness.basics.compiled import compiled, inlined

FREE_SIGMA = 1.0e-3
"""Standard deviation of the housing's depth inside the object, m."""

PRIOR_SIGMA = 5.0e-3
"""Standard deviation of a point of the single-view prior, m: a little more than on held-out shapes."""

_BEND = 3.0
"""Standard deviations beyond which rays, free places and predicted points cost in proportion, not squared."""


class Rows(NamedTuple):
    """Residuals in units of their standard deviations, and what they cost."""

    values: FloatArray  #: ``(rows,)``.
    weights: FloatArray
    """``(rows,)`` by which a squared residual counts at this shape: weight times robustness."""
    along: FloatArray  #: ``(rays,)`` m along each ray where the shape is nearest.
    held: FloatArray
    """``(rays, 3)`` where each is held as derivatives are taken: two places, m, the second's share."""
    met: FloatArray  #: ``(faces, 3)`` m, the place of each housing's face that is nearest to the shape.


@compiled
def first_ray(seen: FamilyEvidence) -> int:
    """Row of the first ray."""
    return int(contact_row_count(seen) + len(seen.faces) + len(seen.free))


@compiled
def first_prior_row(seen: FamilyEvidence) -> int:
    """Row of the first point of the single-view prior."""
    return int(first_ray(seen) + len(seen.rays.kinds))


@compiled
def evaluate(
    code: IntArray,
    theta: FloatArray,
    seen: FamilyEvidence,
    robust: bool,
    out: Rows,
    q: FloatArray,
    most: float,
) -> float:
    """Fill in the rows of a shape; returns half the sum of what they cost.

    ``robust``: whether contacts that do not fit lose their weight; else they pull with a constant force.
    ``most``: cost above which the evaluation stops: infinity is returned, and ``out`` is filled in part.
    """
    prepare(code, theta, q)
    n, m = len(seen.points), len(seen.middles)
    for i in range(n):
        out.values[i] = point_row(code, theta, seen, q, i)
    for j in range(m):
        normal_rows(code, theta, seen, q, j, out.values[n + 3 * j : n + 3 * j + 3])
    off = contact_offsets(seen, out.values)
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
    for i in range(len(seen.prior_points)):
        row = first_prior_row(seen) + i
        out.values[row] = prior_row(code, theta, seen, q, i)
        cost += _weigh(row, seen.prior_weight, out)
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
        ray_direction(theta, rays, i, towards)
        d, out.along[i] = nearest_along(
            code, q, origin, towards, radius, to_middle, rays.kinds[i] == MEET, rays.step
        )
        out.values[first + i] = ray_residual(theta, rays, i, d)
        cost += _weigh(first + i, rays.weight[i], out)
        if cost > most:
            return np.inf
    return cost


@compiled
def free_row(code: IntArray, seen: FamilyEvidence, q: FloatArray, i: int) -> float:
    """Compute the depth of a free place in the shape, in standard deviations; zero outside."""
    p = seen.free[i]
    return float(inside_depth(code, q, p[0], p[1], p[2]) / FREE_SIGMA)


@inlined
def prior_row(code: IntArray, theta: FloatArray, seen: FamilyEvidence, q: FloatArray, i: int) -> float:
    """Residual of a point of the single-view prior: it moves along the support with the camera's error."""
    p = seen.prior_points[i]
    x, y, z = (
        p[0] + theta[CAMERA_RIGHT] * seen.prior_right[0] + theta[CAMERA_DOWN] * seen.prior_down[0],
        p[1] + theta[CAMERA_RIGHT] * seen.prior_right[1] + theta[CAMERA_DOWN] * seen.prior_down[1],
        p[2] + theta[CAMERA_RIGHT] * seen.prior_right[2] + theta[CAMERA_DOWN] * seen.prior_down[2],
    )
    return float(distance(code, q, False, x, y, z) / PRIOR_SIGMA)


@compiled
def _weigh(row: int, weight: float, out: Rows) -> float:
    size = abs(out.values[row])
    if size <= _BEND:
        out.weights[row] = weight
        return float(0.5 * weight * size * size)
    out.weights[row] = weight * _BEND / size
    return float(weight * _BEND * (size - 0.5 * _BEND))


@compiled
def make_rows(seen: FamilyEvidence) -> Rows:
    """Room for the rows of some readings."""
    count = first_prior_row(seen) + len(seen.prior_points)
    rays = len(seen.rays.kinds)
    met = np.zeros((len(seen.faces), 3))
    return Rows(np.zeros(count), np.zeros(count), np.zeros(rays), np.zeros((rays, 3)), met)


@compiled
def prepared_buffer() -> FloatArray:
    """Room for a shape's prepared numbers."""
    return np.empty(PREPARED)


NUDGE = 1.0e-5
"""Step of a finite difference: m, rad or logarithm."""

_MOVES = (X, Y, LIFT)
"""The body's three moves along the axes of ``stand``."""

_CARRIED = (*_MOVES, CAMERA_RIGHT, CAMERA_DOWN, OUTLINE, GEL, GEL + 1, GEL + 2)
"""Numbers whose derivatives follow from those three."""


@compiled
def slopes_along(
    code: IntArray,
    theta: FloatArray,
    seen: FamilyEvidence,
    basis: FloatArray,
    active: IntArray,
    out: Rows,
    q: FloatArray,
) -> FloatArray:
    """``(n, active)`` derivatives of some rows along directions.

    ``basis``: ``(n, size)`` directions.
    ``active``: rows, ascending, of all points and of others.
    ``out``: as ``evaluate`` leaves it; where rays are held is filled in.
    """
    base, here, moves = np.empty(len(active)), np.empty(len(active)), np.empty((3, len(active)))
    hold_rays(code, theta, seen, active, out, q)
    fill_frozen(code, theta, seen, active, out, False, q, base)
    for k in range(3):
        towards = np.zeros(len(theta))
        towards[_MOVES[k]] = NUDGE
        fill_frozen(code, theta + towards, seen, active, out, False, q, here)
        moves[k] = (here - base) / NUDGE
    slopes = np.empty((len(basis), len(active)))
    for i in range(len(basis)):
        rest, slopes[i] = basis[i].copy(), 0.0
        for slot in _CARRIED:
            rest[slot] = 0.0
        if (rest != basis[i]).any():
            _carried(seen, active, moves, basis[i], slopes[i])
        if rest.any():
            # The picture's scale changes no row of touch.
            scale = rest[CAMERA_SCALE] != 0.0 and np.count_nonzero(rest) == 1
            here[:] = base
            fill_frozen(code, theta + NUDGE * rest, seen, active, out, scale, q, here)
            slopes[i] += (here - base) / NUDGE
    return slopes


@compiled
def _carried(
    seen: FamilyEvidence, active: IntArray, moves: FloatArray, direction: FloatArray, out: FloatArray
) -> None:
    """Fill in the derivatives of some rows along a direction by moves of body, gel, camera and outline.

    ``moves`` are the ``(3, active)`` derivatives by the body's moves.
    """
    points, faces = len(seen.points), contact_row_count(seen)
    clear = points + 3 * len(seen.middles)
    free, ray, prior = faces + len(seen.faces), first_ray(seen), first_prior_row(seen)
    right, down, nowhere = direction[CAMERA_RIGHT], direction[CAMERA_DOWN], np.zeros(3)
    seen_off = right * seen.rays.right + down * seen.rays.down
    prior_off = right * seen.prior_right + down * seen.prior_down
    per_outline = direction[OUTLINE] / ray_sigma(seen.rays)
    for row in range(len(active)):
        i, x, y, z = active[row], 0.0, 0.0, 0.0
        if i < faces:
            j = (i - points) // 3
            if i < points:
                j = seen.touch[i]
            elif i >= clear:
                j = seen.clear_touch[i - clear]
            x, y, z = shift_by_gel(direction, seen.gel[j], nowhere)
        elif i < free:
            x, y, z = shift_by_gel(direction, seen.face_gel[i - faces], nowhere)
        elif i >= prior:
            x, y, z = prior_off[0], prior_off[1], prior_off[2]
        elif i >= ray:
            x, y, z = seen_off[0], seen_off[1], seen_off[2]
        # What reads there is farther on by that: as if the body were farther back.
        out[row] = (
            (direction[X] - x) * moves[0, row]
            + (direction[Y] - y) * moves[1, row]
            + (direction[LIFT] - z) * moves[2, row]
        )
        if ray <= i < prior and seen.rays.kinds[i - ray] == GRAZE:
            out[row] -= per_outline


@compiled
def hold_rays(
    code: IntArray, theta: FloatArray, seen: FamilyEvidence, active: IntArray, out: Rows, q: FloatArray
) -> None:
    """Fill in where rays are held, ``out.held``, of those that are active."""
    prepare(code, theta, q)
    first, rays = first_ray(seen), seen.rays
    origin, towards = np.empty(3), np.empty(3)
    ray_origin(theta, rays, origin)
    for row in active:
        i = row - first
        if 0 <= i < len(rays.kinds):
            ray_direction(theta, rays, i, towards)
            hold_ray(code, q, origin, towards, out.along[i], rays.step, out.held[i])


@compiled
def fill_frozen(
    code: IntArray,
    theta: FloatArray,
    seen: FamilyEvidence,
    active: IntArray,
    held: Rows,
    of_sight: bool,
    q: FloatArray,
    out: FloatArray,
) -> None:
    """Fill in the residuals of some rows with rays and housings held in place: what derivatives are taken of.

    ``active``: rows, ascending.
    ``held``: rows as ``evaluate`` and ``hold_rays`` leave them.
    ``of_sight``: whether only rays and points of the single-view prior are filled in.
    ``out``: ``(active,)`` buffer.
    """
    prepare(code, theta, q)
    n, first, ray = len(seen.points), contact_row_count(seen), first_ray(seen)
    clear, free, rays = n + 3 * len(seen.middles), first + len(seen.faces), seen.rays
    towards, origin, triple, last = np.empty(3), np.empty(3), np.empty(3), -1
    ray_origin(theta, rays, origin)
    off = np.empty(0)
    for row in range(len(active)):
        i = active[row]
        if of_sight and i < ray:
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
                off = contact_offsets(seen, out)  # all points are active: their rows are the first
            out[row] = clear_row(code, theta, seen, q, off, i - clear)
        elif i < free:
            x, y, z = shift_by_gel(theta, seen.face_gel[i - first], held.met[i - first])
            out[row] = distance(code, q, False, x, y, z) / seen.face_sigma[i - first]
        elif i < ray:
            out[row] = free_row(code, seen, q, i - free)
        elif i >= first_prior_row(seen):
            out[row] = prior_row(code, theta, seen, q, i - first_prior_row(seen))
        else:
            i -= ray
            ray_direction(theta, rays, i, towards)
            d = held_distance(code, q, origin, towards, held.held[i])
            out[row] = ray_residual(theta, rays, i, d)


@compiled
def active_rows(seen: FamilyEvidence, values: FloatArray) -> IntArray:
    """Rows that pull: of points, normals, housings and grazing rays all, of the others those not zero."""
    first, end = len(seen.points) + 3 * len(seen.middles), first_prior_row(seen)
    rays = first_ray(seen)
    found = np.empty(len(values), np.int64)
    count = 0
    for i in range(len(values)):
        if i < first or values[i] != 0.0 or (rays <= i < end and seen.rays.kinds[i - rays] == GRAZE):
            found[count] = i
            count += 1
    return found[:count]
