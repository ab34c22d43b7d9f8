"""The average of household shapes, which looks at no reading: what any answer must be better than."""

import time
from functools import cache

import numpy as np

from experiments.shape_reconstruction.estimators.grid import Grid
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.surface import SUPPOSED, ShapeEstimate
from harness.basics.arrays import FloatArray, read_only
from harness.basics.faces.mesh_rays import column_crossings
from harness.basics.geometry import rotation_about
from harness.basics.mesh import Mesh
from harness.sim.solid.household.families import FAMILIES, draw

SHAPES = 65
"""Five of each family, each turned by a random angle."""

SIZES = (0.08, 0.28)
"""M, from which the constant size is the geometric middle."""

_CORNERS = 41
_SEED = 20_000
_SMALL_SHARE = 1.0e-3


def by_average(evidence: ShapeEvidence) -> ShapeEstimate:
    """The body in which half of the shapes have their matter at least, of the middle size, where it is put.

    Args:
        evidence: only its greatest possible length is used, to say how unsure this is.
    """
    start = time.perf_counter()
    size = float(np.sqrt(SIZES[0] * SIZES[1]))
    mean = mean_occupancy()
    grid = Grid(np.array([-0.5, -0.5, 0.0]), 1.0 / (_CORNERS - 1), (_CORNERS,) * 3)
    # The level that keeps the mean volume: where half of all agree there may be next to nothing.
    level = float(np.quantile(mean, 1.0 - max(float(mean.mean()), _SMALL_SHARE)))
    field = (level - mean).reshape(grid.shape) * grid.pitch
    field[:, :, 0] = np.maximum(field[:, :, 0], 0.0)  # closed at the support, not below it
    mesh = grid.surface(field).mesh
    count = len(mesh.vertices)
    spread = max(evidence.largest - size, size) / np.sqrt(12.0)
    return ShapeEstimate(
        mesh=Mesh(size * mesh.vertices, mesh.faces),
        deviation=np.full(count, spread),
        known_by=np.full(count, SUPPOSED),
        not_bounded=("x", "y", "z"),
        doubtful={},
        flags=("the average of household shapes, whatever was read",),
        seconds=time.perf_counter() - start,
        details={"estimator": "average", "shapes": SHAPES, "size_m": size},
    )


@cache
def mean_occupancy() -> FloatArray:
    """``(corners,)`` of a grid over the unit cube on the support: share of shapes with matter there."""
    names, random = list(FAMILIES), np.random.default_rng(_SEED)
    pitch = 1.0 / (_CORNERS - 1)
    low = np.array([-0.5, -0.5]) + pitch * np.array([1.1e-4, 1.7e-4])
    sides = np.array([_CORNERS, _CORNERS])
    total = np.zeros((_CORNERS,) * 3)
    for number in range(SHAPES):
        surface = draw(names[number % len(names)], random).surface
        turn = rotation_about(np.array([0.0, 0.0, 1.0]), random.uniform(0.0, 2.0 * np.pi))
        corners = (surface.vertices @ turn.T)[surface.faces]
        line, height, sign = column_crossings(corners, low, np.array([pitch, pitch]), sides)
        above = np.zeros((_CORNERS**2, _CORNERS + 1))
        level = np.clip(np.ceil(height / pitch).astype(np.int64), 0, _CORNERS)
        np.add.at(above, (line, level), sign)
        winding = above.sum(axis=1, keepdims=True) - np.cumsum(above, axis=1)
        total += winding[:, :_CORNERS].reshape((_CORNERS,) * 3) >= 1.0
    return read_only((total / SHAPES).ravel())
