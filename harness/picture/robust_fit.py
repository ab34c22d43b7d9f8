"""Few numbers from many points, some of which are wrong, and errors of points that are wrong together.

Least absolute deviations begin, Tukey's bisquare ends (Huber and Ronchetti, Robust Statistics, 2009, chapters
4 and 7). Standard errors are by blocks of points, which may disagree for any reason (the sandwich of Liang
and Zeger, 1986, with blocks as clusters).
"""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray, read_only

TUKEY = 4.685
"""Robust standard deviations beyond which a point says nothing: 95 % efficient where errors are normal."""

_NORMAL = 1.4826
"""Standard deviation of normal errors over their median size."""

_STARTS = 30
_ROUNDS = 300
_SETTLED = 1e-7


@dataclass(frozen=True, eq=False)
class RobustFit:
    """Values of a linear model."""

    values: FloatArray  #: ``(values,)``.
    moved: FloatArray
    """``(blocks, values)`` how far each block's points pull the values; the root of the sum of their squares
    is the standard error, but for ``blocks / (blocks - 1)`` under the root."""
    scale: float  #: robust standard deviation of what is left.
    outliers: float  #: share of the points that have no weight.

    def __post_init__(self) -> None:
        read_only(self.values)
        read_only(self.moved)


def scatter(left: FloatArray) -> float:
    """Robust standard deviation of what should be zero: by the median of its size."""
    return float(_NORMAL * np.median(np.abs(left)))


def robust_fit(
    design: FloatArray, wanted: FloatArray, blocks: AnyArray, count: int, floor: float
) -> RobustFit | None:
    """Values such that ``design @ values`` is ``wanted``, whatever outliers say.

    Args:
        design: ``(n, values)`` of full rank, finite.
        wanted: ``(n,)`` finite.
        blocks: ``(n,)`` integers, the block of each point, 0 to ``count - 1``.
        count: of blocks; two or more.
        floor: least scale, as of rounding; greater than zero.

    Returns:
        None where no values hold most points together, or none settle to 1e-7.
    """
    # Least absolute deviations, to a few parts of the scatter, where the bisquare takes over.
    start = _weighted(design, wanted, np.ones(wanted.size))
    for _ in range(_STARTS):
        left = np.abs(wanted - design @ start)
        start = _weighted(design, wanted, 1.0 / np.maximum(left, 0.1 * floor))
    # The scale is that of the start and stays: it would else creep up with every outlier that is let in.
    scale = max(scatter(wanted - design @ start), floor)
    values = start
    for _ in range(_ROUNDS):
        u = (wanted - design @ values) / (TUKEY * scale)
        weights = np.where(np.abs(u) < 1.0, (1.0 - u**2) ** 2, 0.0)
        before, values = values, _weighted(design, wanted, weights)
        if np.abs(values - before).max() <= _SETTLED:
            break
    else:
        return None
    u = (wanted - design @ values) / (TUKEY * scale)
    inside = np.abs(u) < 1.0
    slope = np.where(inside, (1.0 - u**2) * (1.0 - 5.0 * u**2), 0.0)
    bread = (design * slope[:, None]).T @ design
    if np.linalg.eigvalsh(bread)[0] <= 0.0:
        return None
    pull = np.where(inside, TUKEY * scale * u * (1.0 - u**2) ** 2, 0.0)[:, None] * design
    pulls = np.column_stack([np.bincount(blocks, column, count) for column in pull.T])
    moved: FloatArray = np.asarray(np.linalg.solve(bread, pulls.T).T, np.float64)
    return RobustFit(values, moved, scale, float(np.mean(~inside)))


def _weighted(design: FloatArray, wanted: FloatArray, weights: FloatArray) -> FloatArray:
    heavy = design * weights[:, None]
    return np.asarray(np.linalg.lstsq(heavy.T @ design, heavy.T @ wanted, rcond=None)[0])
