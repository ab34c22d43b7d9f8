"""A ray of sight's row: how near it passes to a shape, and where it is held as derivatives are taken.

Kernels share arguments: ``code`` and ``theta``, a shape; ``q``, its prepared numbers; ``origin`` and
``towards``, a ray, m in ``stand``.

A ray's least distance changes as that at its nearest place does (the envelope theorem). Where that place is
at an edge, distances on both sides of it change otherwise, and the least one as their mean that has no slope
along the ray (Danskin's theorem): by one side alone a plate would seem pinned along the line of sight.
"""

import numpy as np

from experiments.shape_reconstruction.family.distance import distance, prepare
from experiments.shape_reconstruction.family.layout import (
    BOX,
    CAMERA_DOWN,
    CAMERA_RIGHT,
    CAMERA_SCALE,
    OUTLINE,
    PREPARED,
)
from experiments.shape_reconstruction.family.observed import GRAZE, PASS, SightRays
from harness.basics.arrays import FloatArray, IntArray
from harness.basics.compiled import compiled, inlined

RAY_MODEL = 0.5e-3
"""Standard deviation of the outline of the nearest shape from a real one, m."""

PIXELS = 0.5
"""Standard deviation of the border of a mask, pixels."""

_GOLDEN, _SECTIONS = 0.6180339887498949, 9
"""Fraction of a segment that each golden section keeps, and sections: 5 mm become 0.04 mm."""

_SIDE, _LEVEL = 0.15e-3, 0.05
"""Distance from a ray's nearest place at which slopes are taken, m; slopes from which on it is at an edge."""


@compiled
def ray_origin(theta: FloatArray, rays: SightRays, origin: FloatArray) -> None:
    """Fill in where rays begin, were the camera off by what the shape's vector says."""
    for a in range(3):
        origin[a] = rays.eye[a] + theta[CAMERA_RIGHT] * rays.right[a] + theta[CAMERA_DOWN] * rays.down[a]


@inlined
def ray_direction(theta: FloatArray, rays: SightRays, i: int, towards: FloatArray) -> None:
    """Fill in a ray's direction, were the picture's scale off by what the shape's vector says."""
    scale = theta[CAMERA_SCALE]
    for a in range(3):
        towards[a] = rays.directions[i, a] + scale * (rays.directions[i, a] - rays.middle[a])


@inlined
def ray_sigma(rays: SightRays) -> float:
    """Compute one standard deviation of the distance of a ray from the shape, m."""
    return float(np.hypot(PIXELS * rays.pixel, RAY_MODEL))


@inlined
def ray_residual(theta: FloatArray, rays: SightRays, i: int, d: float) -> float:
    """A ray's residual where it passes the shape at ``d`` m."""
    sigma = ray_sigma(rays)
    if rays.kinds[i] == GRAZE:
        return float((d - theta[OUTLINE]) / sigma)
    if rays.kinds[i] == PASS:
        return float(min(d, 0.0) * rays.gain[i] / sigma)
    return float(max(d, 0.0) / sigma)


@compiled
def hold_ray(
    code: IntArray,
    q: FloatArray,
    origin: FloatArray,
    towards: FloatArray,
    near: float,
    step: float,
    held: FloatArray,
) -> None:
    """Fill ``held``: two places on a ray, m along it, and the weight of the second.

    ``near``: place of least distance so far, m along the ray, known to ``step``.
    ``held``: ``(3,)`` buffer; both places are one where the distance has no edge.
    """
    t = _least_on_ray(code, q, origin, towards, near - step, near + step)
    here = _on_ray(code, q, origin, towards, t)
    falls = here - _on_ray(code, q, origin, towards, t - _SIDE)
    rises = _on_ray(code, q, origin, towards, t + _SIDE) - here
    edge = max(abs(rises), abs(falls)) > _LEVEL * _SIDE and rises > falls
    aside = _SIDE if edge else 0.0
    held[0], held[1] = t - aside, t + aside
    held[2] = min(max(-falls / (rises - falls), 0.0), 1.0) if edge else 0.0


@inlined
def held_distance(
    code: IntArray, q: FloatArray, origin: FloatArray, towards: FloatArray, held: FloatArray
) -> float:
    """Compute the weighted mean distance from a shape at the two places of a held ray, m."""
    d = (1.0 - held[2]) * _on_ray(code, q, origin, towards, held[0])
    return float(d + held[2] * _on_ray(code, q, origin, towards, held[1]) if held[2] > 0.0 else d)


@compiled
def _on_ray(code: IntArray, q: FloatArray, origin: FloatArray, towards: FloatArray, t: float) -> float:
    x, y, z = origin[0] + t * towards[0], origin[1] + t * towards[1], origin[2] + t * towards[2]
    return float(distance(code, q, True, x, y, z))


@compiled
def _least_on_ray(
    code: IntArray, q: FloatArray, origin: FloatArray, towards: FloatArray, low: float, high: float
) -> float:
    """Find the place of least distance between two places on a ray by golden sections."""
    a, b = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
    at_a, at_b = _on_ray(code, q, origin, towards, a), _on_ray(code, q, origin, towards, b)
    for _ in range(_SECTIONS):
        if at_a < at_b:
            high, b, at_b = b, a, at_a
            a = high - _GOLDEN * (high - low)
            at_a = _on_ray(code, q, origin, towards, a)
        else:
            low, a, at_a = a, b, at_b
            b = low + _GOLDEN * (high - low)
            at_b = _on_ray(code, q, origin, towards, b)
    return 0.5 * (low + high)


_MOST = 120
_BEYOND = 10.0e-3
"""Distance above and below the shape at which a ray is still followed, m: it may pass the rim."""

_SURE, _FINE = 0.7, 0.5e-3
"""Fraction of a distance that a line is followed by, as it may be too great at corners; least step, m."""


@compiled
def nearest_along(
    code: IntArray,
    q: FloatArray,
    origin: FloatArray,
    direction: FloatArray,
    radius: float,
    to_middle: FloatArray,
    enough: bool,
    least_step: float,
) -> tuple[float, float]:
    """Find the least signed distance along a ray, m, and its place, m along the ray.

    ``radius``: radius of a ball that holds the shape, m, whose centre is at ``to_middle`` from the origin.
    ``enough``: whether any place inside will do: the ray needs only to hit the shape.
    ``least_step``: distance between places, m.
    """
    along = to_middle[0] * direction[0] + to_middle[1] * direction[1] + to_middle[2] * direction[2]
    square = to_middle[0] ** 2 + to_middle[1] ** 2 + to_middle[2] ** 2 - along * along
    half = np.sqrt(max(radius * radius - square, 0.0))
    t, end = _between_levels(q, origin, direction, along - half, along + half)
    if t >= end:
        return _on_ray(code, q, origin, direction, along), along
    best, where = np.inf, along
    for _ in range(_MOST):
        d = _on_ray(code, q, origin, direction, t)
        if d < best:
            best, where = d, t
            if enough and d < 0.0:
                break
        t += max(abs(d), least_step)
        if t > end:
            break
    return best, where


@compiled
def _between_levels(
    q: FloatArray, origin: FloatArray, direction: FloatArray, first: float, last: float
) -> tuple[float, float]:
    """The part of a ray that is neither far above nor far below the shape."""
    steep = direction[2]
    if abs(steep) < 0.05:
        return first, last
    a = (q[2] + q[BOX + 2] - _BEYOND - origin[2]) / steep
    b = (q[2] + q[BOX + 5] + _BEYOND - origin[2]) / steep
    return max(first, min(a, b)), min(last, max(a, b))


@compiled
def first_hit(
    code: IntArray, theta: FloatArray, starts: FloatArray, directions: FloatArray, length: float
) -> FloatArray:
    """Find the ``(n,)`` first hits of a shape along lines, m; infinite for a line that misses it.

    ``starts``: ``(n, 3)`` m in ``stand``.
    ``directions``: ``(n, 3)`` unit vectors.
    ``length``: length of each line, m.
    """
    q = np.empty(PREPARED)
    prepare(code, theta, q)
    out = np.full(len(starts), np.inf)
    for n in range(len(starts)):
        a, u = starts[n], directions[n]
        t = 0.0
        while t <= length:
            d = distance(code, q, False, a[0] + t * u[0], a[1] + t * u[1], a[2] + t * u[2])
            if d <= 0.0:
                out[n] = t
                break
            # The last step ends where the line does.
            t += min(max(_SURE * d, _FINE), length - t) if t < length else np.inf
    return out
