"""Numbers that survive review: medians and means with the interval that resampling gives them."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import FloatArray

RESAMPLES = 2000


@dataclass(frozen=True)
class Interval:
    """A statistic with its 90 % bootstrap interval (Efron, 1979; percentile form)."""

    value: float  #: of the sample itself.
    low: float  #: 5th percentile over resamples.
    high: float  #: 95th percentile.


def bootstrap(values: FloatArray, statistic: Callable[[FloatArray], FloatArray], seed: int = 0) -> Interval:
    """A statistic of ``(n,)`` values and how much it would vary from sample to sample.

    Args:
        values: finite, at least one.
        statistic: from ``(k, n)`` to ``(k,)``.
        seed: of the resampling; the same values give the same interval.
    """
    if len(values) == 0 or not np.isfinite(values).all():
        raise ValueError(f"a statistic of {len(values)} values, {np.isfinite(values).sum()} of them finite")
    rng = np.random.default_rng(seed)
    resampled = values[rng.integers(0, len(values), (RESAMPLES, len(values)))]
    low, high = np.quantile(statistic(resampled), [0.05, 0.95])
    return Interval(float(statistic(values[None])[0]), float(low), float(high))


def median(values: FloatArray) -> FloatArray:
    """``(k,)`` medians of ``(k, n)``."""
    return np.asarray(np.median(values, axis=1))


def mean(values: FloatArray) -> FloatArray:
    """``(k,)`` means of ``(k, n)``."""
    return np.asarray(values.mean(axis=1))
