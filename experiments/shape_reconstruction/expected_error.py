"""Where the next press says most: by how much it should bring the answer nearer to the truth, in the mean.

The shapes that the readings still allow stand for the truth, each by its weight. What a line is worth is the
Bayes risk, of the distance that answers are judged by, less that after what the gel would read along it.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.family.classes import FamilyShape
from experiments.shape_reconstruction.family.distance import distances
from experiments.shape_reconstruction.family.field import corners_of, grid_distances
from experiments.shape_reconstruction.family.ray_depth import first_met
from experiments.shape_reconstruction.surface import ShapeEstimate
from harness.basics.arrays import FloatArray, IntArray
from harness.skills.exploring.bayes_risk import bayes_risk, bayes_risk_after
from harness.skills.exploring.sensor_face import face_places, gel_first, ways_of

BEFORE = 0.15
"""M before a line's end from where on it is followed."""

DEPTH, NORMAL = 1.5e-3, 0.25
"""M and length of a unit normal's change: deviations of what is read, with how far shapes of the family are
off real ones."""

MOST = 18.0
"""Half squares that two readings differ by at most, and a line that is met and one that is not."""

AGREE = 1.0e-3
"""M of expected error below which shapes are alike, and a press goes where none was."""

CELL, MOST_CELLS, NEAR = 5.0e-3, 60, 0.6
"""M of the grid on which shapes are compared, how many cells it has along a side, and how near to a surface,
in cells, a place of it is of that."""

SHAPES = 80
"""Of hypotheses and the shapes drawn about them, as many of each, at most, roughly."""

_ASIDE = 3.0e-3


def error_spared(evidence: ShapeEvidence, estimate: ShapeEstimate, lines: FloatArray) -> FloatArray | None:
    """By how much a press along each line should lower the mean distance of the answer from the truth.

    Args:
        evidence: says how large an object may be.
        estimate: by the family, with its hypotheses.
        lines: ``(n, 4, 4)`` ``stand_from_gel`` at the ends of lines along their z.

    Returns:
        ``(n,)`` m, none negative; None where the estimate has no hypotheses, or they are alike.
    """
    shapes, weights = _hypotheses(estimate)
    if not shapes:
        return None
    apart = distances_apart(shapes)
    now = bayes_risk(weights, apart)
    if now < AGREE:
        return None
    face = evidence.housing, evidence.gel_thickness
    read = readings_on(shapes, lines, max(BEFORE, 0.5 * evidence.largest), face)
    left = np.array([bayes_risk_after(one, weights, apart, MOST) for one in read.transpose(1, 0, 2)])
    return np.maximum(now - left, 0.0)  # rounding apart, no reading makes it worse


def readings_on(
    shapes: Sequence[FamilyShape], lines: FloatArray, back: float, face: tuple[tuple[float, float], float]
) -> FloatArray:
    """What a press along each line reads on each shape, in deviations of a reading.

    Args:
        shapes: in ``stand``.
        lines: ``(n, 4, 4)`` ``stand_from_gel`` at their ends.
        back: m before its end from where on each is followed.
        face: m, sides ``(x, y)`` of the sensor's housing, and by how much the gel stands out of it.

    Returns:
        ``(shapes, n, 4)``: how far from its end the gel is stopped, and the surface's normal there; infinite
        where the gel goes on to the line's end, or the housing stops it.
    """
    places = face_places(*face)
    starts, ways = ways_of(lines, places, back)
    rows, found = np.arange(len(lines)), np.full((len(shapes), len(lines), 4), np.inf)
    for one, shape in zip(found, shapes, strict=True):
        along = first_met(shape.code, shape.theta, starts, ways, back).reshape(-1, len(places))
        met, first = gel_first(along)
        gone = along[rows, first][met]
        depth = back - gone
        at = starts.reshape(-1, len(places), 3)[rows, first][met] + gone[:, None] * lines[met, :3, 2]
        one[met] = np.column_stack([depth / DEPTH, _normals(shape, at) / NORMAL])
    return found


def _normals(shape: FamilyShape, places: FloatArray) -> FloatArray:
    steps = _ASIDE * np.concatenate([np.eye(3), -np.eye(3)])
    gaps = distances(shape.code, shape.theta, (places[:, None] + steps).reshape(-1, 3)).reshape(-1, 6)
    slopes = gaps[:, :3] - gaps[:, 3:]
    return np.asarray(slopes / np.maximum(np.linalg.norm(slopes, axis=1, keepdims=True), 1e-12))


def distances_apart(shapes: Sequence[FamilyShape]) -> FloatArray:
    """``(n, n)`` m, roughly: half the sum of the mean distances from each surface to each other one."""
    corners = np.concatenate([corners_of(shape) for shape in shapes])
    low, high = corners.min(axis=0) - CELL, corners.max(axis=0) + CELL
    cell = max(CELL, float((high - low).max()) / MOST_CELLS)
    counts: IntArray = np.ceil((high - low) / cell).astype(np.int64) + 1
    # By places, then shapes: those near one surface are rows.
    gaps = np.column_stack([grid_distances(shape, low, cell, counts).ravel() for shape in shapes])
    one_way = np.zeros((len(shapes), len(shapes)))
    for k in range(len(shapes)):
        near = gaps[np.abs(gaps[:, k]) < NEAR * cell]
        if len(near):
            one_way[k] = np.abs(near - near[:, k : k + 1]).mean(axis=0)
    return 0.5 * (one_way + one_way.T)


def _hypotheses(estimate: ShapeEstimate) -> tuple[list[FamilyShape], FloatArray]:
    """The shapes of an estimate, and ``(n,)`` their weights."""
    shapes, weights = [], []
    stated: Sequence[Any] = estimate.details.get("hypotheses", ())  # type: ignore[assignment]
    about = SHAPES // max(len(stated), 1)
    for one in stated:
        every = [one["numbers"], *one.get("about", ())[:about]]
        code: IntArray = np.array(one["code"], dtype=np.int64)
        shapes += [FamilyShape(one["class"], code, np.array(numbers)) for numbers in every]
        weights += [one["weight"] / len(every)] * len(every)
    return shapes, np.array(weights)
