"""Baselines of the shape table: average shape, convex hull, visual hull, and the points of the prior."""

import time
from dataclasses import replace
from functools import cache

import numpy as np
from scipy.spatial import QhullError, cKDTree

from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.fits import UNOBSERVED, ShapeEstimate
from experiments.shape_reconstruction.prior.network import require_silhouette, shipped
from experiments.shape_reconstruction.smooth.free_space import (
    ContactSamples,
    Silhouette,
    all_samples,
    beyond_deviation,
    known_by,
    limited_sides,
    not_bounded,
    sensor_depth,
    shift_sigma,
    silhouette_of,
)
from experiments.shape_reconstruction.smooth.grid import Grid
from harness.basics.arrays import FloatArray, read_only
from harness.basics.errors import FitRefused
from harness.basics.faces.mesh_rays import column_crossings
from harness.basics.geometry import rotation_about
from harness.basics.mesh import Mesh, closed_hull
from harness.sim.solid.household.families import FAMILIES, draw

SHAPES = 65
"""Shapes that are averaged: five of each family, each at a random yaw."""

SIZES = (0.08, 0.28)
"""Smallest and largest size of household shapes, m; the average shape has their geometric mean."""

_CORNERS = 41
_SEED = 20_000
_SMALL_SHARE = 1.0e-3


def by_average(evidence: ShapeEvidence) -> ShapeEstimate:
    """Answer with the average household shape at the nominal place; no reading is used.

    Args:
        evidence: only its largest possible side is used, for the stated deviation.
    """
    start = time.perf_counter()
    size = float(np.sqrt(SIZES[0] * SIZES[1]))
    mean = mean_occupancy()
    grid = Grid(np.array([-0.5, -0.5, 0.0]), 1.0 / (_CORNERS - 1), (_CORNERS,) * 3)
    # The level that keeps the mean volume: half of all shapes may have next to no volume in common.
    level = float(np.quantile(mean, 1.0 - max(float(mean.mean()), _SMALL_SHARE)))
    field = (level - mean).reshape(grid.shape) * grid.pitch
    field[:, :, 0] = np.maximum(field[:, :, 0], 0.0)  # closed at the support, not below it
    mesh = grid.surface(field).mesh
    count = len(mesh.vertices)
    spread = max(evidence.largest - size, size) / np.sqrt(12.0)
    return ShapeEstimate(
        mesh=Mesh(size * mesh.vertices, mesh.faces),
        deviation=np.full(count, spread),
        known_by=np.full(count, UNOBSERVED),
        not_bounded=("x", "y", "z"),
        doubtful={},
        flags=("the average household shape; no reading was used",),
        seconds=time.perf_counter() - start,
        estimator="average",
        counts={"shapes": SHAPES},
    )


@cache
def mean_occupancy() -> FloatArray:
    """Return the fraction of shapes that fill each corner of a grid over the unit cube, ``(corners,)``."""
    names, random = list(FAMILIES), np.random.default_rng(_SEED)
    pitch = 1.0 / (_CORNERS - 1)
    low = np.array([-0.5, -0.5]) + pitch * np.array([1.1e-4, 1.7e-4])
    sides = np.array([_CORNERS, _CORNERS])
    total = np.zeros((_CORNERS,) * 3)
    for number in range(SHAPES):
        surface = draw(names[number % len(names)], random).surface
        turn = rotation_about(np.array([0.0, 0.0, 1.0]), random.uniform(0.0, 2.0 * np.pi))
        corners = (surface.vertices @ turn.T)[surface.faces]
        line, height, sign = column_crossings(corners, low, np.array([pitch, pitch]), sides)
        above = np.zeros((_CORNERS**2, _CORNERS + 1))
        level = np.clip(np.ceil(height / pitch).astype(np.int64), 0, _CORNERS)
        np.add.at(above, (line, level), sign)
        winding = above.sum(axis=1, keepdims=True) - np.cumsum(above, axis=1)
        total += winding[:, :_CORNERS].reshape((_CORNERS,) * 3) >= 1.0
    return read_only((total / SHAPES).ravel())


PITCH = 4.0e-3
"""Pitch of the grids that hulls are extracted from, m."""

_COARSE = 8.0e-3


def by_hull(evidence: ShapeEvidence) -> ShapeEstimate:
    """Answer with the convex hull of all contacts and of the support below the lowest of them.

    Raises:
        FitRefused: no touch met the object, or all contacts lie in one plane, or nearly.
    """
    start = time.perf_counter()
    samples = all_samples(evidence)
    lowest = samples.points[samples.points[:, 2] <= np.quantile(samples.points[:, 2], 0.25)]
    try:
        hull = closed_hull(np.concatenate([samples.points, lowest * np.array([1.0, 1.0, 0.0])]))
    except QhullError as error:
        raise FitRefused(
            f"{len(samples.points)} contact points lie in one plane and span no body; touch another side"
        ) from error
    low, high = hull.bounds
    grid = Grid.over(low - PITCH, high + PITCH, PITCH)
    corners = hull.corners[:, 0]
    beyond = np.full(len(grid.points), -np.inf)
    for corner, normal in zip(corners, hull.face_normals, strict=True):
        np.maximum(beyond, (grid.points - corner) @ normal, out=beyond)
    if beyond.min() >= 0.0:
        raise FitRefused(
            f"{len(evidence.contacts)} contacts span a body less than {1e3 * PITCH:g} mm thick, the pitch of "
            "the hull's grid; touch another side"
        )
    return _with_deviation(evidence, samples, None, grid.surface(beyond).mesh, "hull", start)


def by_visual_hull(evidence: ShapeEvidence) -> ShapeEstimate:
    """Answer with all that silhouette, support and free space leave, no deeper than it is wide.

    Raises:
        FitRefused: no picture shows the object, or nothing is left.
    """
    start = time.perf_counter()
    samples = all_samples(evidence) if evidence.contacts else None
    silhouette = silhouette_of(evidence, np.zeros((0, 3)) if samples is None else samples.points)
    if silhouette is None:
        raise FitRefused(
            "the object is in no picture, so it has no visual hull; take one, or touch the object"
        )
    reach = evidence.largest / np.sqrt(2.0) + 3.0 * evidence.place_error
    low, high = np.array([-reach, -reach, 0.0]), np.array([reach, reach, evidence.largest])
    points = Grid.over(low, high, _COARSE).points
    # The object is as deep along the horizontal direction of sight as it is wide: from where its lowest rays
    # meet the support.
    sight = silhouette.look.stand_from_camera[:3, 2] * np.array([1.0, 1.0, 0.0])
    length = float(np.linalg.norm(sight))
    sight = sight / length if length > 1e-6 else np.array([1.0, 0.0, 0.0])
    near, far = -np.inf, np.inf
    ground = points[(points[:, 2] < _COARSE) & (silhouette.outside_pixels(points) < 0.0)]
    if len(ground):
        least = float((ground @ sight).min())
        across = np.array([-sight[1], sight[0], 0.0])
        near, far = least - _COARSE, least + float(np.ptp(ground @ across)) + _COARSE
    within = sight, near, far
    left = points[_visual_field(evidence, silhouette, points, within) <= _COARSE]
    if len(left) == 0:
        raise FitRefused(
            f"within {reach:.2f} m of where the object should stand nothing fits its silhouette; check the "
            "camera's pose and the object's place"
        )
    low, high = left.min(axis=0) - _COARSE, left.max(axis=0) + _COARSE
    fine = Grid.over(np.maximum(low, [-np.inf, -np.inf, 0.0]), high, PITCH)
    touched = None if samples is None else samples.points
    body = fine.surface(_visual_field(evidence, silhouette, fine.points, within), touched)
    found = _with_deviation(evidence, samples, silhouette, body.mesh, "visual hull", start)
    return replace(found, flags=body.notes)


def _visual_field(
    evidence: ShapeEvidence,
    silhouette: Silhouette,
    points: FloatArray,
    within: tuple[FloatArray, float, float],
) -> FloatArray:
    """Return the signed distances of points from the visual hull in m; negative inside, at least -1."""
    sight, near, far = within
    along = points @ sight
    outside = np.maximum(np.maximum(near - along, along - far), -points[:, 2])
    outside = np.maximum(outside, silhouette.outside_metres(points))
    if evidence.touches:
        outside = np.maximum(outside, sensor_depth(evidence, points))
    return np.asarray(np.maximum(outside, -1.0))


_RATE = 0.25
"""Standard deviation of an untouched surface, relative to its distance from the nearest contact."""

_READING = 0.7e-3


def _with_deviation(
    evidence: ShapeEvidence,
    samples: ContactSamples | None,
    silhouette: Silhouette | None,
    mesh: Mesh,
    name: str,
    start: float,
) -> ShapeEstimate:
    """Complete a surface to an estimate: its deviation grows with the distance from contacts and silhouette.

    Args:
        evidence: readings of the run.
        samples: points of its contacts; None without contacts.
        silhouette: silhouette of its picture; None where the surface does not use it.
        mesh: closed surface in ``stand``, m.
        name: name of the estimator.
        start: ``time.perf_counter()`` when it began, s.
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
        estimator=name,
        counts={"contacts": len(evidence.contacts)},
    )


NEIGHBOURS = 9
"""Neighbours of each point: together some 10,000 points, as many as the published form compares."""


def glance_points(evidence: ShapeEvidence) -> FloatArray:
    """Points of the single-view prior and between them, m; no contact is used.

    Raises:
        FitRefused: nothing was seen, the object fills the picture, or it is too large for the network.
    """
    return interpolate(shipped().points(require_silhouette(evidence).look))


def interpolate(points: FloatArray, neighbours: int = NEIGHBOURS) -> FloatArray:
    """Append the midpoints between each point and its nearest neighbours: ``(n (1 + neighbours), 3)`` in m.

    The paper's network folds a learned patch around every point. On a surface with little curvature between
    neighbours, their midpoints lie on it as well, to the square of the distance over eight radii.

    Args:
        points: ``(n, 3)`` points, more than ``neighbours``, m.
        neighbours: neighbours of each point.
    """
    nearest = np.asarray(cKDTree(points).query(points, k=neighbours + 1)[1])[:, 1:]
    middles = 0.5 * (points[:, None] + points[nearest])
    return np.concatenate([points, middles.reshape(-1, 3)])
