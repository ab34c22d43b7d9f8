"""Evidence made from a drawing: presses where a sensor finds room, and a picture by rays."""

import numpy as np

from experiments.paper.shape_samples import TouchedShape
from experiments.shape_reconstruction.evidence import GuardedTouch, SeenMask, ShapeEvidence
from harness.basics.arrays import FloatArray
from harness.basics.faces.ray_mesh import RayMesh
from harness.basics.geometry import frame_facing, transform
from harness.basics.mesh import Mesh

SIGMA = 0.5e-3
ROWS, COLUMNS, FOCAL = 120, 160, 300.0


def touch_of(points: FloatArray, normal: FloatArray, normals: FloatArray, index: int) -> GuardedTouch:
    """A press that met these places."""
    pose = transform(frame_facing(-normal, 0.0), points.mean(axis=0))
    return GuardedTouch(pose, 0.03, points, normals, SIGMA, 0.05, index)


def presses(mesh: Mesh, count: int, seed: int = 0) -> tuple[GuardedTouch, ...]:
    """All over a mesh that stands on z = 0, each a patch of up to 40 places."""
    shape, random = TouchedShape(mesh, seed), np.random.default_rng(seed)
    places, normals = shape.dense
    made = []
    for index, site in enumerate(random.choice(shape.sites, count)):
        near = np.linalg.norm(places - places[site], axis=1) < 6e-3
        near &= (normals @ normals[site] > 0.8) & (np.abs((places - places[site]) @ normals[site]) < 1e-3)
        rows = random.permutation(np.nonzero(near)[0])[:40]
        off = SIGMA * random.normal(size=(len(rows), 1))
        made.append(touch_of(places[rows] + off * normals[rows], normals[site], normals[rows], index))
    return tuple(made)


def look_at(mesh: Mesh) -> SeenMask:
    """A picture from a metre away, a little from above."""
    camera = camera_pose()
    columns, rows = np.meshgrid(np.arange(COLUMNS) + 0.5, np.arange(ROWS) + 0.5)
    rays = np.stack([(columns - COLUMNS / 2) / FOCAL, (rows - ROWS / 2) / FOCAL, np.ones_like(rows)], -1)
    hits = RayMesh(mesh).first_hits(camera[:3, 3], rays.reshape(-1, 3) @ camera[:3, :3].T)
    mask = np.isfinite(hits.distance).reshape(ROWS, COLUMNS)
    return SeenMask(mask, np.zeros_like(mask), camera, FOCAL, 1e-3, 1e-3, 1e-3)


def camera_pose() -> FloatArray:
    """``(4, 4)`` stand from camera."""
    eye, target = np.array([0.9, -0.2, 0.4]), np.array([0.0, 0.0, 0.04])
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    return transform(np.column_stack([right, np.cross(forward, right), forward]), eye)


def evidence_of(
    touches: tuple[GuardedTouch, ...], look: SeenMask | None = None, largest: float = 0.3
) -> ShapeEvidence:
    """With a sensor of the bench's size."""
    return ShapeEvidence(touches, look, (0.034, 0.03), 2.5e-3, 0.12, 0.02, 1e-3, largest)
