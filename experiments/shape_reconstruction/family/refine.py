"""Levenberg-Marquardt on a shape's vector, along any directions of it."""

from typing import NamedTuple

import numpy as np

from experiments.shape_reconstruction.family.observed import FamilyEvidence
from experiments.shape_reconstruction.family.residuals import (
    Rows,
    active_rows,
    evaluate,
    prepared_room,
    rows_for,
    slopes_along,
)
from harness.basics.arrays import FloatArray, IntArray
from harness.basics.compiled import compiled

_SETTLED = 1.0e-3
"""Of the cost: a round that gains less is the last."""

_HOPELESS = 1.0e6
_MOST = 0.6
"""Longest step of a logarithm or an angle: beyond it the model's slope says nothing."""


class PriorRows(NamedTuple):
    """A normal density about a vector.

    Attributes:
        middle: ``(SIZE,)``.
        rows: ``(k, SIZE)``: ``rows @ (theta - middle)`` are independent, of unit deviation.
    """

    middle: FloatArray
    rows: FloatArray


@compiled
def total_cost(
    code: IntArray,
    theta: FloatArray,
    seen: FamilyEvidence,
    prior: PriorRows,
    robust: bool,
    out: Rows,
    q: FloatArray,
    most: float = np.inf,
) -> float:
    """Half the sum of squares of readings and prior; very large where the shape is no number.

    Of a shape that costs more than ``most``, a number above that, or none; ``out`` is filled in part then.
    """
    off = prior.rows @ (theta - prior.middle)
    believed = 0.5 * np.dot(off, off)
    cost = evaluate(code, theta, seen, robust, out, q, most - believed) + believed
    return cost if np.isfinite(cost) or np.isfinite(most) else _HOPELESS


@compiled
def cheapest(
    code: IntArray, tried: FloatArray, seen: FamilyEvidence, prior: PriorRows, out: Rows, q: FloatArray
) -> tuple[int, float]:
    """Which of ``(n, SIZE)`` vectors of one shape costs least, the first of equals, and what it costs."""
    best, least = 0, np.inf
    for k in range(len(tried)):
        cost = total_cost(code, tried[k], seen, prior, False, out, q, least)
        if cost < least:
            best, least = k, cost
    return best, least


@compiled
def refine(
    code: IntArray,
    theta: FloatArray,
    seen: FamilyEvidence,
    prior: PriorRows,
    basis: FloatArray,
    robust: bool,
    rounds: int,
    curved: bool = True,
) -> tuple[FloatArray, float, FloatArray]:
    """The vector of least cost near one, along the directions of ``basis``.

    Args:
        code: of the shape.
        theta: ``(SIZE,)`` to begin at.
        seen: readings.
        prior: of the vector.
        basis: ``(n, SIZE)`` directions that it may move along.
        robust: whether contacts that do not fit are let go.
        rounds: at most.
        curved: whether the curvature there is wanted; it costs as much as a round.

    Returns:
        The vector, its cost, and ``(n, n)`` the curvature of the cost along the directions; empty where it is
        not wanted.
    """
    best = theta.copy()
    out, trial, q = rows_for(seen), rows_for(seen), prepared_room()
    cost = total_cost(code, best, seen, prior, robust, out, q)
    damping = 1e-2
    along = prior.rows @ basis.T
    curvature, slope, current = np.empty((0, 0)), np.empty(0), False
    for _ in range(rounds):
        if not current:
            curvature, slope = _normal_equations(code, best, seen, prior, basis, along, out, q)
            current = True
        damped = curvature.copy()
        for i in range(len(damped)):
            damped[i, i] += damping * curvature[i, i] + 1e-9
        step = _bounded(np.linalg.solve(damped, -slope).astype(np.float64))
        moved = best + step @ basis
        now = total_cost(code, moved, seen, prior, robust, trial, q, cost)
        if now < cost:
            gain = cost - now
            best, cost, current = moved, now, False
            out, trial = trial, out
            damping = max(0.2 * damping, 1e-6)
            if gain < _SETTLED * cost:
                break
        else:
            damping *= 8.0
            if damping > 1e5:
                break
    if not curved:
        return best, cost, np.empty((0, 0))
    if not current:
        curvature, slope = _normal_equations(code, best, seen, prior, basis, along, out, q)
    return best, cost, curvature


@compiled
def _bounded(step: FloatArray) -> FloatArray:
    longest = np.abs(step).max()
    return step * (_MOST / longest) if longest > _MOST else step


@compiled
def _normal_equations(
    code: IntArray,
    theta: FloatArray,
    seen: FamilyEvidence,
    prior: PriorRows,
    basis: FloatArray,
    along: FloatArray,
    out: Rows,
    q: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Gauss-Newton's curvature and slope along the directions."""
    rows = active_rows(seen, out.values)
    root = np.sqrt(out.weights[rows])
    slopes = slopes_along(code, theta, seen, basis, rows, out, q) * root
    off = prior.rows @ (theta - prior.middle)
    curvature = slopes @ slopes.T + along.T @ along
    slope = slopes @ (out.values[rows] * root) + along.T @ off
    return curvature, slope
