"""A closed surface around the points of a glance."""

import time

import numpy as np

from experiments.shape_reconstruction.estimators.knowledge import known_by, limited_sides, not_bounded
from experiments.shape_reconstruction.estimators.picture import silhouette_of
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.pcn.completed_surface import SPREAD, closed_around
from experiments.shape_reconstruction.pcn.glance import glanced, shipped
from experiments.shape_reconstruction.surface import ShapeEstimate


def by_glanced_surface(evidence: ShapeEvidence) -> ShapeEstimate:
    """What household shapes look like that: closed by a ball as wide as the gaps between the points.

    It heeds no touch. Its deviation is what the network was off on shapes that were held out; nothing but
    what it has learnt limits how deep the object is along the line of sight, and ``not_bounded`` says so.

    Raises:
        FitRefused: nothing was seen.
    """
    start = time.perf_counter()
    points = glanced(evidence)
    mesh, seen = closed_around(points), silhouette_of(evidence, np.zeros((0, 3)))
    return ShapeEstimate(
        mesh=mesh,
        deviation=np.full(len(mesh.vertices), SPREAD * shipped().held_out),
        known_by=known_by(mesh, None, seen),
        not_bounded=not_bounded(limited_sides(mesh, None, seen)),
        doubtful={},
        flags=("by the picture alone: what is behind is supposed, as household shapes are",),
        seconds=time.perf_counter() - start,
        details={"estimator": "glance", "points": len(points)},
    )
