"""A closed surface around the points of a glance."""

import time

import numpy as np

from experiments.shape_reconstruction.estimators.free_space import Silhouette
from experiments.shape_reconstruction.estimators.knowledge import known_by, limited_sides, not_bounded
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.pcn.completed_surface import SPREAD, closed_around
from experiments.shape_reconstruction.pcn.glance import shipped, silhouette_to_glance_at
from experiments.shape_reconstruction.surface import ShapeEstimate
from harness.basics.arrays import FloatArray

GAP, BLUR = 6.0, 1.0
"""As ``closed_around`` has them: points of a glance lie some millimetres off the surface, so that a smaller
ball finds holes between them. Of eight development pictures such surfaces are of one piece each."""


def by_glanced_surface(evidence: ShapeEvidence) -> ShapeEstimate:
    """What household shapes look like that: closed by a ball as wide as the gaps between the points.

    It heeds no touch. Its deviation is what the network was off on shapes that were held out, and twice what
    its points lie outside of their own silhouette: so much it has not understood. Nothing but what it has
    learnt limits how deep the object is along the line of sight, and ``not_bounded`` says so.

    Raises:
        FitRefused: nothing was seen, the object fills the picture, or it is too large for the network.
    """
    start = time.perf_counter()
    seen = silhouette_to_glance_at(evidence)
    points = shipped().points(seen.look)
    body = closed_around(points, GAP, BLUR)
    mesh, deviation = body.mesh, prior_deviation(seen, points)
    return ShapeEstimate(
        mesh=mesh,
        deviation=np.full(len(mesh.vertices), deviation),
        known_by=known_by(mesh, None, seen),
        not_bounded=not_bounded(limited_sides(mesh, None, seen)),
        doubtful={},
        flags=(
            "by the picture alone: its class is not told, and what is behind is supposed, as household "
            "shapes are",
            *body.notes,
        ),
        seconds=time.perf_counter() - start,
        details={"estimator": "glance", "points": len(points)},
    )


def prior_deviation(seen: Silhouette, points: FloatArray) -> float:
    """Compute one standard deviation of the single-view prior's surface, m.

    Args:
        seen: the silhouette.
        points: ``(n, 3)`` places that the network predicts, m.
    """
    return float(np.hypot(SPREAD * shipped().held_out, 2.0 * _outside(seen, points)))


def _outside(seen: Silhouette, points: FloatArray) -> float:
    """M, root mean square of how far points lie outside of the silhouette."""
    pixel = float(np.linalg.norm(seen.look.stand_from_camera[:3, 3])) / seen.look.focal_length
    return pixel * float(np.sqrt(np.mean(np.maximum(seen.outside_pixels(points), 0.0) ** 2)))
