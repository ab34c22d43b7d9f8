"""The mixture's median surface: signed distances of its shapes on a grid, evaluated near surfaces only."""

import numpy as np

from experiments.shape_reconstruction.family.distance import distance, prepare
from experiments.shape_reconstruction.family.kind import FamilyShape
from experiments.shape_reconstruction.family.kinds import kind_of
from experiments.shape_reconstruction.family.layout import BOX, PREPARED
from experiments.shape_reconstruction.family.posterior import Mixture
from experiments.shape_reconstruction.smooth.grid import BodySurface, extract_body
from harness.basics.arrays import FloatArray, IntArray
from harness.basics.compiled import compiled

BLOCK = 4
"""Cells a side that are filled at once where no surface is near."""

_STEEP = 1.4
"""Greatest slope of a distance: of a superellipse, beside its corners."""

_MOST = 160
"""Cells along a side: larger bodies are sampled more coarsely."""

_RESOLVED = 1.2
"""Thickness of a wall, over a cell, from which on the grid shows no hole in it."""

_FINER = (1.0, 0.5, 0.25)
"""Fractions of the cell, tried in turn until a corner of the grid is inside the body."""

_SLIVER = 0.3
"""Half the thickness of a part thinner than a cell, in cells."""

BELOW = 5.0e-3
"""Depth below the nominal support at which an answer is cut, m: a handle of a hypothesis may dip into it."""

_WEIGHT = 0.03
"""Below it a hypothesis does not move the median."""


def median_surface(mixture: Mixture, pitch: float, contacts: FloatArray | None = None) -> BodySurface:
    """Extract the median surface of the hypotheses as one body: half of the weight lies inside it.

    Args:
        mixture: of shapes in ``stand``.
        pitch: m of the grid; finer where a wall is thin, coarser where the body is larger than 160 cells. A
            wall too thin for the grid that is left is drawn as thick as it shows, on its inner side.
        contacts: ``(n, 3)`` points of the surface that were touched, m; they decide which piece is the body.
    """
    pairs = zip(mixture.hypotheses, mixture.weights, strict=True)
    kept = [(one.shape, float(weight)) for one, weight in pairs if weight >= _WEIGHT]
    shapes, weights = [shape for shape, _ in kept], np.array([weight for _, weight in kept])
    corners = np.concatenate([corners_of(shape) for shape in shapes])
    low, high = corners.min(axis=0) - 4e-3, corners.max(axis=0) + 4e-3
    thinnest = np.inf
    for shape in shapes:
        # The shortest side of a body's own box; of a hollow one, wall or floor where that is thinner.
        q = np.empty(PREPARED)
        prepare(shape.code, shape.theta, q)
        shortest = float((q[BOX + 3 : BOX + 6] - q[BOX : BOX + 3]).min())
        thinnest = min(thinnest, shortest, _wall(shape))
    coarsest = max(min(pitch, thinnest / _RESOLVED), float((high - low).max()) / _MOST)
    for finer in _FINER:
        cell = finer * coarsest
        counts = np.ceil((high - low) / cell).astype(np.int64) + 1
        thick = [_thickened(shape, _RESOLVED * cell) for shape in shapes]
        fields = np.stack([grid_distances(shape, low, cell, counts) for shape in thick])
        median = _weighted_median(fields, weights / weights.sum())
        # Thin bodies that lie apart have no place in common that half of the belief is inside of.
        inside = median if median.min() < 0.0 else fields[0]
        if inside.min() < 0.0:
            break
    else:
        # A plate thinner than any cell: drawn as thick as it shows.
        inside = inside - (inside.min() + _SLIVER * finer * coarsest)
    heights = low[2] + cell * np.arange(inside.shape[2])
    return extract_body(np.maximum(inside, -BELOW - heights), low, cell, contacts)


def _wall(shape: FamilyShape) -> float:
    """Return the smaller thickness of wall and floor, m; infinite for a solid body."""
    walls = list(kind_of(shape.code).traits(shape.code).walls)
    return float(np.exp(shape.theta[walls].min())) if walls else np.inf


def _thickened(shape: FamilyShape, least: float) -> FamilyShape:
    """Return the shape with wall and floor at least so thick, m; its outside is unchanged."""
    if _wall(shape) >= least:
        return shape
    theta, walls = shape.theta.copy(), list(kind_of(shape.code).traits(shape.code).walls)
    theta[walls] = np.maximum(theta[walls], np.log(least))
    return FamilyShape(shape.name, shape.code, theta)


def grid_distances(shape: FamilyShape, origin: FloatArray, cell: float, counts: IntArray) -> FloatArray:
    """``counts`` m: signed distances, right near the surface and of the right sign elsewhere."""
    return np.asarray(_fill(shape.code, shape.theta, origin, cell, counts))


def corners_of(shape: FamilyShape) -> FloatArray:
    """``(8, 3)`` m: corners of a shape's own box, in ``stand``; its leaning aside."""
    q = np.empty(PREPARED)
    prepare(shape.code, shape.theta, q)
    low, high = q[BOX : BOX + 3], q[BOX + 3 : BOX + 6]
    x, y, z = np.meshgrid(*zip(low, high, strict=True))
    return np.column_stack(
        [
            q[0] + q[3] * x.ravel() - q[4] * y.ravel(),
            q[1] + q[4] * x.ravel() + q[3] * y.ravel(),
            q[2] + z.ravel(),
        ]
    )


def _weighted_median(fields: FloatArray, weights: FloatArray) -> FloatArray:
    if len(fields) == 1 or weights.max() > 0.5:
        return np.asarray(fields[int(weights.argmax())])
    order = np.argsort(fields, axis=0)
    below = np.cumsum(weights[order], axis=0)
    first = np.argmax(below >= 0.5, axis=0)
    which = np.take_along_axis(order, first[None], axis=0)
    return np.asarray(np.take_along_axis(fields, which, axis=0)[0])


@compiled
def _fill(code: IntArray, theta: FloatArray, origin: FloatArray, cell: float, counts: IntArray) -> FloatArray:
    q = np.empty(PREPARED)
    prepare(code, theta, q)
    out = np.empty((counts[0], counts[1], counts[2]))
    reach = _STEEP * np.sqrt(3.0) * 0.5 * BLOCK * cell + cell
    for i in range(0, counts[0], BLOCK):
        for j in range(0, counts[1], BLOCK):
            for k in range(0, counts[2], BLOCK):
                half = 0.5 * (BLOCK - 1)
                x, y, z = (
                    origin[0] + (i + half) * cell,
                    origin[1] + (j + half) * cell,
                    origin[2] + (k + half) * cell,
                )
                middle = distance(code, q, False, x, y, z)
                near = abs(middle) < reach
                for a in range(i, min(i + BLOCK, counts[0])):
                    for b in range(j, min(j + BLOCK, counts[1])):
                        for c in range(k, min(k + BLOCK, counts[2])):
                            if near:
                                x, y, z = origin[0] + a * cell, origin[1] + b * cell, origin[2] + c * cell
                                out[a, b, c] = distance(code, q, False, x, y, z)
                            else:
                                out[a, b, c] = middle
    return out
