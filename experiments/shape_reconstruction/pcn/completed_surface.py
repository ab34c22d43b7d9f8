"""A closed surface around the points that the network completes: what a gap between them could not let in."""

import time
from dataclasses import replace

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from experiments.shape_reconstruction.estimators.contact_samples import all_samples
from experiments.shape_reconstruction.estimators.grid import BodySurface, Grid
from experiments.shape_reconstruction.estimators.knowledge import (
    beyond_deviation,
    known_by,
    limited_sides,
    not_bounded,
)
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.pcn.network import shipped
from experiments.shape_reconstruction.surface import ShapeEstimate
from harness.basics.arrays import FloatArray
from harness.basics.mesh import Mesh

PITCH = 3.0e-3

GAP = 4.0
"""Median distances between neighbouring points: a ball of this radius does not pass between points of one
wall, and does enter a vessel."""

SPREAD = float(np.sqrt(0.5 * np.pi))
"""Standard deviations of a normal density over the mean of its absolute values."""


def by_completed_surface(evidence: ShapeEvidence) -> ShapeEstimate:
    """The network's points as a body: closed by a ball as wide as the gaps between them.

    It looks at no picture. Its deviation is what the network was off on shapes that were held out.

    Raises:
        FitRefused: no touch met the object.
        OutOfDomain: touches in one place, at the support.
    """
    start = time.perf_counter()
    samples = all_samples(evidence)
    points = shipped().completed(samples.points)
    body = closed_around(points)
    mesh = body.mesh
    known, sides = known_by(mesh, samples, None), limited_sides(mesh, samples, None)
    beyond = beyond_deviation(mesh, known, sides, evidence.largest)
    return ShapeEstimate(
        mesh=mesh,
        deviation=np.hypot(SPREAD * shipped().held_out, beyond),
        known_by=known,
        not_bounded=not_bounded(sides),
        doubtful={},
        flags=body.notes,
        seconds=time.perf_counter() - start,
        details={"estimator": "pcn", "points": len(points)},
    )


def closed_around(points: FloatArray, gap: float = GAP, blur: float = 0.0) -> BodySurface:
    """Extract the morphological closing of points, a pitch outside of them and above the support.

    Args:
        points: ``(n, 3)`` places all over a body, m.
        gap: median distances between neighbouring points that the closing ball does not pass.
        blur: pitches over which the surface is smoothed.

    Raises:
        OutOfDomain: as ``isosurface``.
    """
    grid, outside = closing_field(points, gap, blur)
    body = grid.surface(outside)
    above = np.maximum(body.mesh.vertices, [-np.inf, -np.inf, 0.0])
    return replace(body, mesh=Mesh(above, body.mesh.faces))


def closing_field(
    points: FloatArray, gap: float = GAP, blur: float = 0.0, margin: float = 3.0 * PITCH
) -> tuple[Grid, FloatArray]:
    """Compute the field whose zero is the morphological closing of points, on a grid around them.

    Args:
        points: ``(n, 3)`` places all over a body, m.
        gap: median distances between neighbouring points that the closing ball does not pass.
        blur: pitches over which the field is smoothed.
        margin: distance from the closing ball to the border of the grid, m.

    Returns:
        The grid, and ``(corners,)`` m, negative inside; outside it grows no farther than the ball's radius.
    """
    apart = float(np.median(cKDTree(points).query(points, k=[2])[0]))
    radius = max(gap * apart, 2.0 * PITCH)
    reach = radius + margin
    grid = Grid.over(points.min(axis=0) - reach, points.max(axis=0) + reach, PITCH)
    near = (np.asarray(cKDTree(points).query(grid.points)[0]) <= radius).reshape(grid.shape)
    around = ndimage.binary_fill_holes(near)
    depth = grid.pitch * np.asarray(ndimage.distance_transform_edt(around))
    return grid, np.asarray(ndimage.gaussian_filter(radius - grid.pitch - depth, blur)).ravel()
