"""All the space that an object of uncertain size and place may take: no travel of the arm enters it."""

from functools import cache
from itertools import product

import numpy as np
from scipy.spatial import ConvexHull

from harness.basics.arrays import FloatArray, read_only
from harness.basics.mesh import Mesh
from harness.basics.mesh_hull import closed_hull, hull_of

PLACES = 3.0
"""Standard deviations of its place that are kept free around it."""

MARGIN = 5.0e-3
"""M around an object wherever it may stand, in every direction: its tilt, and what its model leaves out."""

SHARE = 0.03
"""Of its size, in addition."""

_ROUND = 16


def margin_of(size: float) -> float:
    """M that are kept free around an object of a size in m, beside where it may be put."""
    return MARGIN + SHARE * size


def around(places: FloatArray, off: float, margin: float, support: float) -> Mesh:
    """The convex hull of all that is near ``(n, 3)`` m in base, above a support.

    Args:
        places: of an object.
        off: m along the support, in any direction.
        margin: m beyond that, in every direction.
        support: m, height of the support: what the hull has below it is cut off.
    """
    moved = hull_of(_sum(places, off * _disc()))
    return closed_hull(_above(_sum(moved, margin * _ball()), support))


def _sum(places: FloatArray, shifts: FloatArray) -> FloatArray:
    """``(n, 3)`` every one of the places, shifted by every one of the shifts."""
    return np.asarray((places[:, None] + shifts).reshape(-1, 3))


@cache
def _disc() -> FloatArray:
    """``(n, 3)`` corners of a level polygon that holds the unit disc."""
    turns = np.arange(_ROUND) * 2.0 * np.pi / _ROUND
    reach = 1.0 / np.cos(np.pi / _ROUND)
    return read_only(np.column_stack([reach * np.cos(turns), reach * np.sin(turns), np.zeros(_ROUND)]))


@cache
def _ball() -> FloatArray:
    """``(26, 3)`` corners of a polytope that holds the unit ball: to a cube's sides, edges and corners."""
    ways = np.array([way for way in product((-1.0, 0.0, 1.0), repeat=3) if any(way)])
    ways = ways / np.linalg.norm(ways, axis=1)[:, None]
    nearest_side = -float(ConvexHull(ways).equations[:, 3].max())
    return read_only(ways / nearest_side)


def _above(places: FloatArray, height: float) -> FloatArray:
    """``(m, 3)`` that span the part above a height of the convex hull of ``(n, 3)`` m.

    To lift what is below would not do: the hull of lifted corners lacks places above the height.
    """
    hull = ConvexHull(places)
    edges = np.concatenate([hull.simplices[:, pair] for pair in ((0, 1), (1, 2), (2, 0))])
    start, end = places[edges[:, 0]], places[edges[:, 1]]
    crossing = (start[:, 2] - height) * (end[:, 2] - height) < 0.0
    start, end = start[crossing], end[crossing]
    share = (height - start[:, 2]) / (end[:, 2] - start[:, 2])
    cut = start + share[:, None] * (end - start)
    cut[:, 2] = height
    corners = places[hull.vertices]
    return np.concatenate([corners[corners[:, 2] >= height], cut])
