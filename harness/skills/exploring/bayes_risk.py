"""What a reading should bring: the error that is expected of the best answer, before it and after it.

Hypotheses that readings still allow stand for the truth, each by its weight. The best answer among them is
the one that is nearest to all in the mean, and how far it is from them is the Bayes risk. What would be read
on each tells some of them from others, and of those that it leaves another may be best: what a reading
spares is the risk before it less the risk after it (Raiffa and Schlaifer, Applied statistical decision
theory, 1961).
"""

import numpy as np

from harness.basics.arrays import FloatArray


def bayes_risk(weights: FloatArray, apart: FloatArray) -> float:
    """The expected error of the best answer.

    Args:
        weights: ``(n,)`` of the hypotheses, summing to 1.
        apart: ``(n, n)`` error of one as the answer where another is the truth, in any unit.
    """
    return float((apart @ weights).min())


def bayes_risk_after(read: FloatArray, weights: FloatArray, apart: FloatArray, most: float) -> float:
    """The same after a reading, in the mean over what may be read; rounding apart, it is no greater.

    Args:
        read: ``(n, k)`` what would be read on each, in standard deviations; the first of a row infinite where
            nothing is met.
        weights: ``(n,)``.
        apart: ``(n, n)``.
        most: half a sum of squares by which two readings differ at most, as models are off; what is met and
            what is not differ by as much.
    """
    met = np.isfinite(read[:, 0])
    both = met[:, None] & met
    seen = np.where(met[:, None], read, 0.0)
    halves = 0.5 * np.sum((seen[:, None] - seen) ** 2, axis=2)
    cost = np.where(both, np.minimum(halves, most), np.where(met[:, None] ^ met, most, 0.0))
    believed = np.exp(-cost) * weights
    believed /= believed.sum(axis=1, keepdims=True)
    return float(weights @ (believed @ apart).min(axis=1))
