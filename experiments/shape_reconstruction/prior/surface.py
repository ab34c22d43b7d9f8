"""A closed surface around the points of a glance."""

import time
from dataclasses import replace

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.fits import ShapeEstimate
from experiments.shape_reconstruction.prior.network import require_silhouette, shipped
from experiments.shape_reconstruction.smooth.free_space import Silhouette
from experiments.shape_reconstruction.smooth.grid import BodySurface, Grid
from experiments.shape_reconstruction.smooth.knowledge import known_by, limited_sides, not_bounded
from harness.basics.arrays import FloatArray
from harness.basics.mesh import Mesh

PITCH = 3.0e-3
"""Pitch of the grid, m."""

GAP = 6.0
"""Radius of the closing ball over the median distance of neighbouring points. The predicted points are a few
millimetres off the surface: a smaller ball finds holes between them."""

BLUR = 1.0
"""Standard deviation of the smoothing, in pitches."""

SPREAD = float(np.sqrt(0.5 * np.pi))
"""Standard deviation of a normal density over the mean of its absolute values."""


def predict_surface(evidence: ShapeEvidence) -> ShapeEstimate:
    """Answer with a closed surface around the points of the glance; no contact is used.

    The deviation is the network's error on held-out shapes, and twice the distance of its points outside of
    their own silhouette. Only the network limits the depth of the object along the line of sight, and
    ``not_bounded`` states so.

    Raises:
        FitRefused: nothing was seen, the object fills the picture, or it is too large for the network.
    """
    start = time.perf_counter()
    seen = require_silhouette(evidence)
    points = shipped().points(seen.look)
    body = closed_around(points)
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
        estimator="glance",
        counts={"points": len(points)},
    )


def prior_deviation(seen: Silhouette, points: FloatArray) -> float:
    """Compute one standard deviation of the single-view prior's surface, m.

    Args:
        seen: the silhouette.
        points: ``(n, 3)`` points that the network predicts, m.
    """
    pixel = float(np.linalg.norm(seen.look.stand_from_camera[:3, 3])) / seen.look.focal_length
    outside = pixel * float(np.sqrt(np.mean(np.maximum(seen.outside_pixels(points), 0.0) ** 2)))
    return float(np.hypot(SPREAD * shipped().held_out, 2.0 * outside))


def closed_around(points: FloatArray) -> BodySurface:
    """Extract the morphological closing of points, one pitch outside of them and above the support.

    Args:
        points: ``(n, 3)`` points all over a body, m.

    Raises:
        OutOfDomain: as ``isosurface``.
    """
    grid, outside = closing_field(points)
    body = grid.surface(outside)
    above = np.maximum(body.mesh.vertices, [-np.inf, -np.inf, 0.0])
    return replace(body, mesh=Mesh(above, body.mesh.faces))


def closing_field(points: FloatArray, margin: float = 3.0 * PITCH) -> tuple[Grid, FloatArray]:
    """Compute the field whose zero is the morphological closing of points, on a grid around them.

    Args:
        points: ``(n, 3)`` points all over a body, m.
        margin: distance from the closing ball to the border of the grid, m.

    Returns:
        The grid, and ``(corners,)`` m, negative inside; outside it grows no farther than the ball's radius.
    """
    apart = float(np.median(cKDTree(points).query(points, k=[2])[0]))
    radius = max(GAP * apart, 2.0 * PITCH)
    reach = radius + margin
    grid = Grid.over(points.min(axis=0) - reach, points.max(axis=0) + reach, PITCH)
    near = (np.asarray(cKDTree(points).query(grid.points)[0]) <= radius).reshape(grid.shape)
    around = ndimage.binary_fill_holes(near)
    depth = grid.pitch * np.asarray(ndimage.distance_transform_edt(around))
    return grid, np.asarray(ndimage.gaussian_filter(radius - grid.pitch - depth, BLUR)).ravel()
