"""How sure a plain body is: from how far each part of it is from what was touched and seen."""

import time

import numpy as np
from scipy.spatial import cKDTree

from experiments.shape_reconstruction.estimators.contact_samples import ContactSamples
from experiments.shape_reconstruction.estimators.free_space import Silhouette, shift_sigma
from experiments.shape_reconstruction.estimators.knowledge import (
    beyond_deviation,
    known_by,
    limited_sides,
    not_bounded,
)
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.surface import ShapeEstimate
from harness.basics.mesh import Mesh

_RATE = 0.25
"""Of the distance from the nearest contact: one standard deviation of a surface that is supposed there."""

_READING = 0.7e-3


def plain_answer(
    evidence: ShapeEvidence,
    samples: ContactSamples | None,
    silhouette: Silhouette | None,
    mesh: Mesh,
    name: str,
    start: float,
) -> ShapeEstimate:
    """A body as an answer: each vertex is the less sure, the farther it is from what was read.

    Args:
        evidence: of the run.
        samples: of its contacts; None where there are none.
        silhouette: of its picture; None where the body does not use it.
        mesh: closed, m in ``stand``.
        name: of the estimator.
        start: s, ``time.perf_counter()`` when it began.
    """
    known, sides = known_by(mesh, samples, silhouette), limited_sides(mesh, samples, silhouette)
    spread = np.full(len(mesh.vertices), np.inf)
    if samples is not None:
        spread = _RATE * np.asarray(cKDTree(samples.points).query(mesh.vertices)[0])
    if silhouette is not None:
        depth = silhouette.pixels(mesh.vertices)[1]
        sigma = np.hypot(1.0, shift_sigma(silhouette.look, float(depth.mean())))
        beside = np.abs(silhouette.outside_metres(mesh.vertices))
        spread = np.minimum(spread, beside + sigma * depth / silhouette.look.focal_length)
    beyond = beyond_deviation(mesh, known, sides, evidence.largest)
    return ShapeEstimate(
        mesh=mesh,
        deviation=np.sqrt(spread**2 + _READING**2 + beyond**2),
        known_by=known,
        not_bounded=not_bounded(sides),
        doubtful={},
        flags=(),
        seconds=time.perf_counter() - start,
        details={"estimator": name, "contacts": len(evidence.contacts)},
    )
