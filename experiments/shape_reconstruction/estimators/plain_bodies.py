"""The plainest bodies that hold what was touched or seen: a box, a hull, what lies within the silhouette."""

import time
from dataclasses import replace

import numpy as np
from scipy.spatial import QhullError

from experiments.shape_reconstruction.estimators.contact_samples import all_samples
from experiments.shape_reconstruction.estimators.free_space import Silhouette, sensor_depth, silhouette_of
from experiments.shape_reconstruction.estimators.grid import Grid
from experiments.shape_reconstruction.estimators.plain_answer import plain_answer
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.surface import ShapeEstimate
from harness.basics.arrays import FloatArray
from harness.basics.errors import FitRefused
from harness.basics.faces.isosurface import isosurface
from harness.basics.mesh import Mesh
from harness.basics.mesh_hull import closed_hull

PITCH = 4.0e-3
_THIN = 2.0e-3
_YAWS = 45
_COARSE = 8.0e-3


def by_box(evidence: ShapeEvidence) -> ShapeEstimate:
    """The upright box of least area that holds all contacts, down to the support.

    Raises:
        FitRefused: no touch met the object.
    """
    start = time.perf_counter()
    samples = all_samples(evidence)
    yaws = np.arange(_YAWS) * 0.5 * np.pi / _YAWS
    turns = [np.array([[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]]) for yaw in yaws]
    turn = min(turns, key=lambda one: float(np.prod(np.ptp(samples.points[:, :2] @ one.T, axis=0) + _THIN)))
    placed = samples.points[:, :2] @ turn.T
    low, high = placed.min(axis=0), placed.max(axis=0)
    half = 0.5 * np.append(np.maximum(high - low, _THIN), max(samples.points[:, 2].max(), _THIN))
    middle = np.append(0.5 * (low + high) @ turn, half[2])
    mesh = _box_mesh(half)
    rotation = np.eye(3)
    rotation[:2, :2] = turn.T
    return plain_answer(
        evidence, samples, None, Mesh(mesh.vertices @ rotation.T + middle, mesh.faces), "box", start
    )


def _box_mesh(half: FloatArray) -> Mesh:
    """About the origin, its faces so fine that each vertex can say how well it is known."""
    pitch = max(PITCH, float(half.max()) / 25.0)
    axes = [np.linspace(-1.0, 1.0, max(3, int(np.ceil(2.0 * side / pitch)) + 1)) for side in half]
    count = np.array([len(axis) for axis in axes])
    field = np.pad(np.full(count - 1, -1.0), 1, constant_values=1.0)
    shell = isosurface(field, np.zeros(3), 1.0)
    # The surface crosses midway between corners: grid numbers 0.5 to n - 0.5 are the box's sides.
    share = (shell.vertices - 0.5) / (count - 1)
    return Mesh((2.0 * np.clip(share, 0.0, 1.0) - 1.0) * half, shell.faces)


def by_hull(evidence: ShapeEvidence) -> ShapeEstimate:
    """The convex hull of all contacts, and of what is below the lowest of them.

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
    return plain_answer(evidence, samples, None, grid.surface(beyond).mesh, "hull", start)


def by_visual_hull(evidence: ShapeEvidence) -> ShapeEstimate:
    """All that the silhouette, the support and free space leave, no deeper than it looks wide.

    Raises:
        FitRefused: no picture in which the object is seen.
        OutOfDomain: nothing is left.
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
    coarse = Grid.over(low, high, _COARSE)
    within = _slab(silhouette, coarse.points)
    left = coarse.points[_beyond(evidence, silhouette, coarse.points, within) <= _COARSE]
    if len(left) == 0:
        raise FitRefused(
            f"within {reach:.2f} m of where the object should stand nothing fits its silhouette; check the "
            "camera's pose and the object's place"
        )
    low, high = left.min(axis=0) - _COARSE, left.max(axis=0) + _COARSE
    fine = Grid.over(np.maximum(low, [-np.inf, -np.inf, 0.0]), high, PITCH)
    touched = None if samples is None else samples.points
    body = fine.surface(_beyond(evidence, silhouette, fine.points, within), touched)
    found = plain_answer(evidence, samples, silhouette, body.mesh, "visual hull", start)
    return replace(found, flags=body.notes)


def _slab(silhouette: Silhouette, points: FloatArray) -> tuple[FloatArray, float, float]:
    """Level direction of sight, and m along it from and to which the object is.

    From where its lowest rays meet the support, as much farther as it looks wide there.
    """
    sight = silhouette.look.stand_from_camera[:3, 2] * np.array([1.0, 1.0, 0.0])
    length = float(np.linalg.norm(sight))
    sight = sight / length if length > 1e-6 else np.array([1.0, 0.0, 0.0])
    ground = points[(points[:, 2] < _COARSE) & (silhouette.outside_pixels(points) < 0.0)]
    seen = points[silhouette.outside_pixels(points) < 0.0]
    if len(ground) == 0 or len(seen) == 0:
        return sight, -np.inf, np.inf
    near = float((ground @ sight).min())
    across = np.array([-sight[1], sight[0], 0.0])
    return sight, near - _COARSE, near + float(np.ptp(ground @ across)) + _COARSE


def _beyond(
    evidence: ShapeEvidence, silhouette: Silhouette, points: FloatArray, slab: tuple[FloatArray, float, float]
) -> FloatArray:
    sight, near, far = slab
    along = points @ sight
    outside = np.maximum(np.maximum(near - along, along - far), -points[:, 2])
    outside = np.maximum(outside, silhouette.outside_metres(points))
    if evidence.touches:
        outside = np.maximum(outside, sensor_depth(evidence, points))
    return np.asarray(np.maximum(outside, -1.0))
