"""Which of many lines the gel follows next: a score for each, by what is known so far."""

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.expected_error import error_spared
from experiments.shape_reconstruction.section import Choice
from experiments.shape_reconstruction.surface import ShapeEstimate
from harness.basics.arrays import FloatArray
from harness.basics.faces.ray_mesh import RayMesh

Chooser = Callable[[ShapeEvidence, ShapeEstimate | None, FloatArray], FloatArray]
"""Of evidence, an estimate (None where there is none yet) and ``(n, 4, 4)`` ``stand_from_gel`` at the ends of
lines, drawn at random, that the gel would follow along its z: ``(n,)`` scores; the greatest goes first."""

BEHIND = 0.3
"""M before a line's end from where on it is looked for the estimate's surface."""


def blindly(_evidence: ShapeEvidence, _estimate: ShapeEstimate | None, lines: FloatArray) -> FloatArray:
    """All alike: they are drawn at random, and followed in that order."""
    return np.zeros(len(lines))


def farthest(evidence: ShapeEvidence, estimate: ShapeEstimate | None, lines: FloatArray) -> FloatArray:
    """M from where a line should meet the object to the nearest place that a way has led to."""
    led = [
        touch.points.mean(axis=0) if touch.met else touch.stand_from_gel[:3, 3] for touch in evidence.touches
    ]
    if not led:
        return np.zeros(len(lines))
    return np.asarray(cKDTree(np.array(led)).query(meeting_places(estimate, lines))[0])


def most_informative(
    evidence: ShapeEvidence, estimate: ShapeEstimate | None, lines: FloatArray
) -> FloatArray:
    """M of expected error that a press along each line spares; as ``farthest`` while likely shapes agree."""
    spared = None if estimate is None else error_spared(evidence, estimate, lines)
    return farthest(evidence, estimate, lines) if spared is None else spared


CHOOSERS: dict[Choice, Chooser] = {"random": blindly, "farthest": farthest, "active": most_informative}
"""Of lines into what is not known, by ``shape.choose``."""


def meeting_places(estimate: ShapeEstimate | None, lines: FloatArray) -> FloatArray:
    """``(n, 3)`` m in ``stand``: where lines meet an estimate first; their ends where they meet nothing.

    Args:
        estimate: None where there is none yet.
        lines: ``(n, 4, 4)``.
    """
    ends, forward = lines[:, :3, 3], lines[:, :3, 2]
    if estimate is None:
        return ends
    found = RayMesh(estimate.mesh).first_hits(ends - BEHIND * forward, forward)
    short = np.minimum(found.distance, BEHIND)  # a line that passes the surface by ends where it was to end
    return np.asarray(ends - (BEHIND - short)[:, None] * forward)
