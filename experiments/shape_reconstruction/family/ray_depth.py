"""How near a ray of sight passes to a shape, and where a line first meets one."""

import numpy as np

from experiments.shape_reconstruction.family.distance import BOX, PREPARED, distance, prepare
from harness.basics.arrays import FloatArray, IntArray
from harness.basics.compiled import compiled

_MOST = 120
_BEYOND = 10.0e-3
"""M above and below the shape at which a ray is still followed: it may pass its rim."""

_SURE, _FINE = 0.7, 0.5e-3
"""Of a distance, the share that a line is followed by at once, as distances may be too great by so much
beside corners; and m, the least step."""


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
    """Least signed distance along a ray, and how far along it is.

    Args:
        code: of the shape.
        q: its prepared numbers.
        origin: ``(3,)`` m.
        direction: ``(3,)`` unit.
        radius: m of a ball that holds the shape.
        to_middle: ``(3,)`` m from the origin to the ball's middle.
        enough: whether any place inside will do: the ray needs only to meet the shape.
        least_step: m between places on it.

    Returns:
        M: the least distance found, and where; of a ray that misses the ball, at its place nearest to it.
    """
    along = to_middle[0] * direction[0] + to_middle[1] * direction[1] + to_middle[2] * direction[2]
    square = to_middle[0] ** 2 + to_middle[1] ** 2 + to_middle[2] ** 2 - along * along
    half = np.sqrt(max(radius * radius - square, 0.0))
    t, end = _between_levels(q, origin, direction, along - half, along + half)
    if t >= end:
        d = distance(
            code,
            q,
            True,
            origin[0] + along * direction[0],
            origin[1] + along * direction[1],
            origin[2] + along * direction[2],
        )
        return d, along
    best, where = np.inf, along
    for _ in range(_MOST):
        d = distance(
            code,
            q,
            True,
            origin[0] + t * direction[0],
            origin[1] + t * direction[1],
            origin[2] + t * direction[2],
        )
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
def first_met(
    code: IntArray, theta: FloatArray, starts: FloatArray, directions: FloatArray, length: float
) -> FloatArray:
    """How far along lines a shape is met first.

    Args:
        code: of the shape.
        theta: its ``(SIZE,)`` vector.
        starts: ``(n, 3)`` m in ``stand``.
        directions: ``(n, 3)`` unit.
        length: m of each line.

    Returns:
        ``(n,)`` m; infinite of a line that ends before it meets the shape.
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
