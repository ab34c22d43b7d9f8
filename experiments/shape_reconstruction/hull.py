"""The convex hull of all contacts, down to the support: what an object takes at least, were it convex."""

import time

import numpy as np
from scipy.spatial import cKDTree

from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.family.known import known_by, not_bounded
from experiments.shape_reconstruction.surface import ShapeEstimate
from harness.basics.errors import FitRefused
from harness.basics.mesh_hull import closed_hull

AWAY = 0.5
"""M of deviation for each m from the nearest contact."""

FLATTEST = 1.0e-3
"""M of the support under the contacts that counts as the object's, so that a flat one has a volume."""


def hull_estimate(evidence: ShapeEvidence) -> ShapeEstimate:
    """The hull of the contacts and of what is right below them.

    Args:
        evidence: a contact at least.

    Raises:
        FitRefused: nothing was touched.
    """
    began = time.perf_counter()
    if not evidence.contacts:
        raise FitRefused(
            "the hull is one of contacts, and the gel has touched nothing; press, or take another method"
        )
    touched = np.concatenate([touch.points for touch in evidence.contacts])
    below = touched * [1.0, 1.0, 0.0]
    about = FLATTEST * np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
    points = np.concatenate([touched, below, *(below.mean(axis=0) + about)[:, None]])
    mesh = closed_hull(points)
    away = cKDTree(touched).query(mesh.vertices)[0]
    sigma = max(touch.sigma for touch in evidence.contacts)
    return ShapeEstimate(
        mesh=mesh,
        deviation=np.hypot(sigma, AWAY * away),
        known_by=known_by(mesh.vertices, evidence),
        not_bounded=not_bounded(evidence),
        doubtful={},
        flags=(),
        seconds=time.perf_counter() - began,
        details={"kind": "hull"},
    )
