"""More points of a surface from those that the network gives: the middles between neighbours."""

import numpy as np
from scipy.spatial import cKDTree

from harness.basics.arrays import FloatArray

NEIGHBOURS = 9
"""Of each point: with itself some 10,000 points in all, as many as others compare."""


def interpolated(points: FloatArray, neighbours: int = NEIGHBOURS) -> FloatArray:
    """``(n (1 + neighbours), 3)`` m: the points, then the middles between each and its nearest ones.

    The network of the paper folds a patch around every point, which is learnt. On a surface that bends little
    between neighbours their middles lie on it as well, to the square of the distance over eight radii.

    Args:
        points: ``(n, 3)`` m, more than ``neighbours``.
        neighbours: of each point.
    """
    nearest = np.asarray(cKDTree(points).query(points, k=neighbours + 1)[1])[:, 1:]
    middles = 0.5 * (points[:, None] + points[nearest])
    return np.concatenate([points, middles.reshape(-1, 3)])
