"""All the space that an object of uncertain size and place may take: no travel of the arm enters it."""

from collections.abc import Sequence
from functools import cache
from itertools import product

import numpy as np
from scipy.spatial import ConvexHull

from experiments.scale_estimation.model import ObjectModel
from experiments.scale_estimation.vision.outline import hull_of
from experiments.scale_estimation.vision.vision import SeenStand
from harness.basics.arrays import FloatArray, read_only
from harness.basics.mesh import Mesh
from harness.basics.mesh_hull import closed_hull

PLACES = 3.0
"""Standard deviations of its place that are kept free around it."""

MARGIN = 5.0e-3
"""M around an object wherever it may stand, in every direction: its tilt, and what its model leaves out."""

SHARE = 0.03
"""Of its size, in addition."""

_YAWS = 24
_ROUND = 16


def blind_envelope(model: ObjectModel) -> Mesh:
    """Where the object may be before anything is known: the largest one, any way round; in base."""
    size = model.sizes.high
    turns = np.arange(_YAWS) * 2.0 * np.pi / _YAWS
    stands = [np.array([np.log(size / model.nominal), 0.0, 0.0, yaw]) for yaw in turns]
    reach = float(np.linalg.norm(model.corners[:, :2], axis=1).max()) * size / model.nominal
    between = reach * (1.0 / np.cos(np.pi / _YAWS) - 1.0)
    return envelope(model, stands, PLACES * model.place_error + between, margin_of(size))


def seen_envelope(model: ObjectModel, stands: Sequence[SeenStand]) -> Mesh:
    """Where it may be after a look, in every turn that was not ruled out; in base."""
    largest = model.nominal * float(np.exp(max(stand.unknowns[0] for stand in stands)))
    off = PLACES * max(stand.place_error for stand in stands)
    return envelope(model, [stand.unknowns for stand in stands], off, margin_of(largest))


def margin_of(size: float) -> float:
    """M that are kept free around an object of a size in m, beside where it may be put."""
    return MARGIN + SHARE * size


def envelope(model: ObjectModel, stands: Sequence[FloatArray], off: float, margin: float) -> Mesh:
    """The space of an object that may stand in several ways.

    Args:
        model: of the object.
        stands: ``(4,)`` each, log of the size over the nominal one, x, y, m, yaw, rad.
        off: m that it may be off each of them, along the support, in any direction.
        margin: m around it, in every direction.

    Returns:
        Convex, in base, nothing of it below the support.
    """
    corners = model.corners
    places = hull_of(np.concatenate([placed(model, corners, stand) for stand in stands]))
    return around(places, off, margin, float(model.place[2]))


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


def placed(model: ObjectModel, standing: FloatArray, stand: FloatArray) -> FloatArray:
    """``(n, 3)`` m in base: places of the nominal standing object, of that size, there and so turned."""
    cosine, sine = np.cos(stand[3]), np.sin(stand[3])
    turned = np.column_stack(
        [
            cosine * standing[:, 0] - sine * standing[:, 1],
            sine * standing[:, 0] + cosine * standing[:, 1],
            standing[:, 2],
        ]
    )
    return np.asarray(np.exp(stand[0]) * turned + model.place + np.array([stand[1], stand[2], 0.0]))


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
