"""How a gel may be turned and slid against the view that it is compared with: small, and to first order.

Shapes: ``reading`` is the tuple ``(heights, pitch, touched, flat, skirt, edge)`` of a ``TouchMap``;
``sigmas`` is ``(rms, tilt, spin)`` of a ``TouchNoise``; ``lean`` is ``(LEAN,)`` numbers of a fit.
"""

import numpy as np

from harness.basics.arrays import BoolArray, FloatArray, IntArray
from harness.basics.compiled import compiled

Reading = tuple[FloatArray, float, IntArray, BoolArray, FloatArray, FloatArray]
Sigmas = tuple[float, float, float]

_WITHIN = 0.35
"""Pixels of the map, one sigma of how far a place may be from the nearest that is looked at."""


@compiled
def put_lean(a: FloatArray, plane: FloatArray, sigmas: Sigmas, lean: FloatArray) -> None:
    """What ``leaning`` needs of a fit, from its normal equations and the plane that it found."""
    variance = sigmas[1] ** 2
    lean[0], lean[1] = plane[1] / variance, plane[2] / variance
    lean[2] = lean[3] = lean[4] = 0.0
    if a[0, 0] > 0.0:
        # How well the image tells the tilts, its depth free; the prior's precision is one in these units.
        told = variance / (a[0, 0] * sigmas[0] ** 2)
        xx = 1.0 + told * (a[1, 1] - a[0, 1] * a[0, 1] / a[0, 0])
        yy = 1.0 + told * (a[2, 2] - a[0, 2] * a[0, 2] / a[0, 0])
        xy = told * (a[1, 2] - a[0, 1] * a[0, 2] / a[0, 0])
        det = xx * yy - xy * xy
        lean[2] = (1.0 - yy / det) / variance
        lean[3] = xy / det / variance
        lean[4] = (1.0 - xx / det) / variance


@compiled
def slid(pressed: FloatArray, reading: Reading, sigmas: Sigmas, lean: FloatArray) -> float:
    """By how much the cost falls where the picture is slid and turned in its own plane as fits best.

    To first order. It is slid within a pixel, between the places that are looked at: without that an edge
    fits some of them by chance, far better than their neighbours. ``lean`` is left as ``leaning`` needs it.
    """
    heights, flat = reading[0], reading[3]
    rows, columns = heights.shape
    xx = yy = tt = xy = xt = yt = bx = by = bt = 0.0
    for i in range(1, rows - 1):
        for j in range(1, columns - 1):
            if flat[i, j]:
                continue
            across = 0.5 * (pressed[i, j + 1] - pressed[i, j - 1])
            down = 0.5 * (pressed[i + 1, j] - pressed[i - 1, j])
            # A turn moves places by (-y, x), in pixels as the slopes are.
            turn = (j + 0.5 - 0.5 * columns) * down - (i + 0.5 - 0.5 * rows) * across
            gap = heights[i, j] - pressed[i, j]
            xx += across * across
            yy += down * down
            tt += turn * turn
            xy += across * down
            xt += across * turn
            yt += down * turn
            bx += across * gap
            by += down * gap
            bt += turn * gap
    unit = len(reading[2]) * sigmas[0] ** 2
    about, within = unit / sigmas[2] ** 2, unit / _WITHIN**2
    xx, yy, tt = xx + within, yy + within, tt + about
    c_xx, c_xy, c_xt = yy * tt - yt * yt, xt * yt - xy * tt, xy * yt - xt * yy
    c_yy, c_yt, c_tt = xx * tt - xt * xt, xy * xt - xx * yt, xx * yy - xy * xy
    det = xx * c_xx + xy * c_xy + xt * c_xt
    x = (c_xx * bx + c_xy * by + c_xt * bt) / det
    y = (c_xy * bx + c_yy * by + c_yt * bt) / det
    turn = (c_xt * bx + c_yt * by + c_tt * bt) / det
    # Farther than a pixel the slopes are others.
    share = min(1.0, 1.0 / max(np.abs(x), np.abs(y), 1e-9))
    lean[5] = share * turn / sigmas[2] ** 2
    lean[6] = (1.0 - about * c_tt / det) / sigmas[2] ** 2
    return float(share * (2.0 - share) * (bx * x + by * y + bt * turn) / unit)


@compiled
def leaning(lean: FloatArray, tilt_x: float, tilt_y: float, spin: float) -> float:
    """Nats that a score gains where the gel is expected to be turned by so much, not by nothing.

    The fit's prior is about no turn. Moved to another, the least cost changes by the terms of a quadratic
    whose curvature is the fit's own: along what the image does not tell it changes nothing.
    """
    return float(
        lean[0] * tilt_x
        + lean[1] * tilt_y
        + lean[5] * spin
        - 0.5 * lean[6] * spin * spin
        - 0.5 * (lean[2] * tilt_x * tilt_x + 2.0 * lean[3] * tilt_x * tilt_y + lean[4] * tilt_y * tilt_y)
    )


@compiled
def leanings_at(leans: FloatArray, tilt_x: float, tilt_y: float, spin: float) -> FloatArray:
    """``(n,)``: see ``leaning``, of ``(n, LEAN)`` fits."""
    result = np.empty(len(leans))
    for n in range(len(leans)):
        result[n] = leaning(leans[n], tilt_x, tilt_y, spin)
    return result


def turns_between(base_from_gel: FloatArray, turns: FloatArray) -> FloatArray:
    """How the gel stands against one that looks upon an object turned by so much less about base z.

    Args:
        base_from_gel: ``(3, 3)`` rotation.
        turns: ``(n,)`` rad, small.

    Returns:
        ``(n, 3)`` to first order: the gel's slopes along x and y of its picture, and its turn in that plane.
    """
    # The object turned one way is the gel turned the other, about z as the gel has it.
    x, y, z = -base_from_gel[2]
    return np.outer(turns, np.array([y, -x, z]))
