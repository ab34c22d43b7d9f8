"""From the height map of one press to points of the object's surface with normals, in the gel's frame."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import binary_erosion, gaussian_filter

from experiments.shape_reconstruction import thresholds as limits
from harness.basics.arrays import BoolArray, FloatArray, IntArray

POINTS = 40
"""Points of a press, spread over what was touched."""

CLEAR = 12
"""Places of a press, spread over what was not touched."""

_SMOOTH = 2.0
"""Pixels, one standard deviation of the window that slopes are averaged over."""

_BORDER = 1.0e-3
"""What a slope counts for that is taken across the border of what was touched; one inside counts for 1."""


@dataclass(frozen=True, eq=False)
class ContactPoints:
    """What the gel touched, in its own frame: z out of the sensor, towards the object."""

    points: FloatArray  #: ``(n, 3)`` m.
    normals: FloatArray  #: ``(n, 3)`` unit, out of the object.
    error: float  #: m, one standard deviation of the points' heights by the picture alone.
    clear: FloatArray
    """``(k, 3)`` m, on the gel's face where it touched nothing: no part of the object is there."""


def contact_points(heights: FloatArray, errors: FloatArray, pitch: float) -> ContactPoints | None:
    """Points spread over what a press touched; None where it touched nothing.

    Args:
        heights: ``(rows, columns)`` m of indentation.
        errors: ``(rows, columns)`` m, one standard deviation of them.
        pitch: m of gel that a pixel shows.
    """
    deepest = float(heights.max())
    if not deepest > limits.MIN_INDENTATION:
        return None
    core = heights >= limits.CONTACT_DEPTH * deepest
    rows, columns = _spread(core, POINTS)
    points = _on_face(heights.shape, rows, columns, pitch)
    points[:, 2] = -heights[rows, columns]
    # Slopes are averaged, not heights: at a border the average of heights leans inward.
    weight = np.where(binary_erosion(core, border_value=1), 1.0, _BORDER) * core
    total = np.maximum(gaussian_filter(weight, _SMOOTH), np.finfo(np.float64).tiny)
    down, right = np.gradient(heights, pitch)
    slopes = np.stack(
        [(gaussian_filter(weight * slope, _SMOOTH) / total)[rows, columns] for slope in (right, down)], axis=1
    )
    normals = np.column_stack([-slopes, -np.ones(len(slopes))])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    clear = _on_face(heights.shape, *_spread(heights < limits.MIN_INDENTATION, CLEAR), pitch)
    return ContactPoints(points, normals, float(np.median(errors[rows, columns])), clear)


def _on_face(shape: tuple[int, ...], rows: IntArray, columns: IntArray, pitch: float) -> FloatArray:
    across = (columns - 0.5 * (shape[1] - 1)) * pitch
    along = (rows - 0.5 * (shape[0] - 1)) * pitch
    return np.column_stack([across, along, np.zeros(len(rows))])


def _spread(core: BoolArray, count: int) -> tuple[IntArray, IntArray]:
    """Rows and columns of pixels far from each other, each the farthest from those before."""
    places = np.argwhere(core)
    if not len(places):
        return places[:, 0], places[:, 1]
    chosen = [int(np.linalg.norm(places - places.mean(axis=0), axis=1).argmin())]
    apart = np.linalg.norm(places - places[chosen[0]], axis=1)
    while len(chosen) < min(count, len(places)):
        chosen.append(int(apart.argmax()))
        apart = np.minimum(apart, np.linalg.norm(places - places[chosen[-1]], axis=1))
    return places[chosen, 0], places[chosen, 1]
