"""Few points that span many."""

import numpy as np

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.compiled import compiled


@compiled
def farthest_points(points: FloatArray, count: int) -> IntArray:
    """Rows of ``(n, d)`` points, each the farthest from those before it (Gonzalez, 1985); all where few.

    The first is the nearest to their middle, so that the choice does not depend on their order.
    """
    n = len(points)
    if n <= count:
        return np.arange(n)
    middle = np.zeros(points.shape[1])
    for i in range(n):
        middle += points[i] / n
    gap = np.empty(n)
    for i in range(n):
        gap[i] = np.sum((points[i] - middle) ** 2)
    chosen = np.empty(count, np.int64)
    chosen[0] = np.argmin(gap)
    gap[:] = np.inf
    for k in range(1, count):
        for i in range(n):
            gap[i] = min(gap[i], np.sum((points[i] - points[chosen[k - 1]]) ** 2))
        chosen[k] = np.argmax(gap)
    return chosen
