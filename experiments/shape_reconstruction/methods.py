"""Estimators of shape by their names: levels of the dial ``shape.method``."""

from collections.abc import Callable, Mapping

import numpy as np

from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.surface import SUPPOSED, ShapeEstimate
from harness.basics.errors import FitRefused
from harness.basics.mesh_hull import closed_hull

Method = Callable[[ShapeEvidence], ShapeEstimate]


def _hull(evidence: ShapeEvidence) -> ShapeEstimate:
    if not evidence.contacts:
        raise FitRefused("no contacts")
    points = np.concatenate([touch.points for touch in evidence.contacts])
    mesh = closed_hull(np.concatenate([points, points * [1.0, 1.0, 0.0]]))
    n = len(mesh.vertices)
    return ShapeEstimate(mesh, np.full(n, 5e-3), np.full(n, SUPPOSED), (), {}, (), 0.0)


METHODS: Mapping[str, Method] = {"hull": _hull}
QUICK = "hull"
BEST = "hull"
