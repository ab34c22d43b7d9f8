"""Where the next press says most: where the shapes that the readings still allow differ along its line."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.family.classes import FamilyShape
from experiments.shape_reconstruction.family.distance import distances
from experiments.shape_reconstruction.surface import ShapeEstimate
from harness.basics.arrays import FloatArray, IntArray

BEFORE, STEP = 0.15, 2.0e-3
"""M before a line's end from where on it is followed, and between places on it."""

MOST = 12.0e-3
"""M of disagreement beyond which more says no more: a grazing line differs most, and is rarely met."""

AGREE = 2.5e-3
"""M of the greatest disagreement below which the shapes are alike, and a press goes where none was."""


def disagreement(evidence: ShapeEvidence, estimate: ShapeEstimate, lines: FloatArray) -> FloatArray | None:
    """How far apart along each line the shapes that the readings allow are met, if that differs at all.

    A line that some of the shapes pass by counts by the square of the probability that it meets the object:
    a miss says little.

    Args:
        evidence: says how large an object may be.
        estimate: by the family, with its hypotheses.
        lines: ``(n, 4, 4)`` ``stand_from_gel`` at the ends of lines along their z.

    Returns:
        ``(n,)`` m; None where the estimate has no hypotheses, or they agree along all lines.
    """
    shapes, weights = _hypotheses(estimate)
    if not shapes:
        return None
    back = max(BEFORE, 0.5 * evidence.largest)
    depths = np.array([_depths(shape, lines, back) for shape in shapes])
    met = np.isfinite(depths)
    share = np.where(met, weights[:, None], 0.0)
    probability = share.sum(axis=0)
    total = np.maximum(probability, 1e-12)
    known = np.where(met, depths, 0.0)
    middle = (share * known).sum(axis=0) / total
    spread = np.sqrt((share * (known - middle) ** 2).sum(axis=0) / total)
    scores = np.minimum(spread, MOST) * probability**2
    return None if scores.max() < AGREE else np.asarray(scores)


def _hypotheses(estimate: ShapeEstimate) -> tuple[list[FamilyShape], FloatArray]:
    """The shapes of an estimate, and ``(n,)`` their weights."""
    shapes, weights = [], []
    stated: Sequence[Any] = estimate.details.get("hypotheses", ())  # type: ignore[assignment]
    for one in stated:
        every = [one["numbers"], *one.get("about", ())]
        code: IntArray = np.array(one["code"], dtype=np.int64)
        shapes += [FamilyShape(one["class"], code, np.array(numbers)) for numbers in every]
        weights += [one["weight"] / len(every)] * len(every)
    return shapes, np.array(weights)


def _depths(shape: FamilyShape, lines: FloatArray, back: float) -> FloatArray:
    """``(n,)`` m before its end where each line first meets a shape; infinite where it does not."""
    along = np.arange(-back, 0.5 * STEP, STEP)
    places = lines[:, None, :3, 3] + along[:, None] * lines[:, None, :3, 2]
    gaps = distances(shape.code, shape.theta, places.reshape(-1, 3)).reshape(len(lines), len(along))
    inside = gaps < 0.0
    first = inside.argmax(axis=1)
    rows = np.arange(len(lines))
    before = np.maximum(first - 1, 0)
    high, low = gaps[rows, before], gaps[rows, first]
    fall = np.where(high > low, high - low, 1.0)
    depth = -along[before] - STEP * np.clip(high / fall, 0.0, 1.0)
    return np.where(inside.any(axis=1), depth, np.inf)
