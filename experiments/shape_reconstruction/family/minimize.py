"""Minimise the cost of a shape: readings and prior, along the free directions of its vector."""

from typing import NamedTuple

import numpy as np

from experiments.shape_reconstruction.family.observed import FamilyEvidence
from experiments.shape_reconstruction.family.residuals import (
    Rows,
    active_rows,
    evaluate,
    make_rows,
    prepared_buffer,
    slopes_along,
)
from harness.basics.arrays import FloatArray, IntArray
from harness.basics.compiled import compiled


class PriorRows(NamedTuple):
    """A normal density of a shape's vector."""

    middle: FloatArray  #: ``(size,)`` mean.
    rows: FloatArray  #: ``(k, size)``: ``rows @ (theta - middle)`` are independent, of unit deviation.


_SETTLED = 1.0e-3  #: fraction of the cost: an iteration that gains less is the last.

_HOPELESS = 1.0e6
_MAX_STEP = 0.6
"""Longest step of a logarithm or an angle: beyond it the model's slope says nothing."""


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
    """Compute half the sum of squares of readings and prior; very large where the shape is not finite.

    The evaluation of a shape that costs more than ``most`` stops early: the result is above ``most``.
    """
    off = prior.rows @ (theta - prior.middle)
    by_prior = 0.5 * np.dot(off, off)
    cost = evaluate(code, theta, seen, robust, out, q, most - by_prior) + by_prior
    return cost if np.isfinite(cost) or np.isfinite(most) else _HOPELESS


@compiled
def cheapest(
    code: IntArray, tried: FloatArray, seen: FamilyEvidence, prior: PriorRows, out: Rows, q: FloatArray
) -> tuple[int, float]:
    """Find which of ``(n, size)`` vectors costs least, the first of equals; return its row and cost."""
    best, least = 0, np.inf
    for k in range(len(tried)):
        cost = total_cost(code, tried[k], seen, prior, False, out, q, least)
        if cost < least:
            best, least = k, cost
    return best, least


@compiled
def minimize(
    code: IntArray,
    theta: FloatArray,
    seen: FamilyEvidence,
    prior: PriorRows,
    basis: FloatArray,
    robust: bool,
    rounds: int,
    curved: bool = True,
) -> tuple[FloatArray, float, FloatArray]:
    """Find the vector of least cost near a start, along the directions of ``basis`` (Levenberg-Marquardt).

    Args:
        code: kind and parts of the shape.
        theta: ``(size,)`` start.
        seen: the readings.
        prior: density of the vector.
        basis: ``(n, size)`` directions that it may move along.
        robust: whether contacts that do not fit lose their weight.
        rounds: most iterations.
        curved: whether the curvature there is wanted; it costs as much as a round.

    Returns:
        The vector, its cost, and ``(n, n)`` the curvature of the cost along the directions; empty where it is
        not wanted.
    """
    best = theta.copy()
    out, trial, q = make_rows(seen), make_rows(seen), prepared_buffer()
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
        step = np.linalg.solve(damped, -slope).astype(np.float64)
        longest = np.abs(step).max()
        if longest > _MAX_STEP:
            step = step * (_MAX_STEP / longest)
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
    """Compute Gauss-Newton's curvature and slope of the cost along the directions."""
    rows = active_rows(seen, out.values)
    root = np.sqrt(out.weights[rows])
    slopes = slopes_along(code, theta, seen, basis, rows, out, q) * root
    off = prior.rows @ (theta - prior.middle)
    curvature = slopes @ slopes.T + along.T @ along
    slope = slopes @ (out.values[rows] * root) + along.T @ off
    return curvature, slope
