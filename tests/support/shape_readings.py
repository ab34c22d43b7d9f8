"""What touches and a picture of a body would read, made from its mesh without a bench."""

import numpy as np

from experiments.shape_reconstruction.evidence import GuardedTouch, SeenMask, ShapeEvidence
from harness.basics.arrays import FloatArray, read_only
from harness.basics.faces.ray_mesh import RayMesh
from harness.basics.geometry import frame_facing, transform
from harness.basics.mesh import Mesh
from harness.picture.pinhole import Pinhole
from harness.sim.solid.surface_samples import random_points

HOUSING = (34e-3, 30e-3)
SIGMA = 0.3e-3
_PATCH = 5e-3
_DOWNWARD = 0.25


def touch_at(mesh: Mesh, point: FloatArray, normal: FloatArray, index: int) -> GuardedTouch:
    """A press along the normal at a place of the surface: the surface's corners around it are its points."""
    pose = transform(frame_facing(-normal, 0.0), point)
    near = np.linalg.norm(mesh.vertices - point, axis=1) < _PATCH
    near &= mesh.vertex_normals @ normal > 0.8
    points = np.concatenate([point[None], mesh.vertices[near]])[:40]
    normals = np.concatenate([normal[None], mesh.vertex_normals[near]])[:40]
    return GuardedTouch(pose, 30e-3, points, normals, SIGMA, float(np.radians(3.0)), index)


def touches_on(mesh: Mesh, count: int, seed: int) -> tuple[GuardedTouch, ...]:
    """Presses where the housing fits, none from below."""
    random = np.random.default_rng(seed)
    rays = RayMesh(mesh)
    found: list[GuardedTouch] = []
    while len(found) < count:
        points, faces = random_points(mesh, 64, random)[:2]
        for point, face in zip(points, faces, strict=True):
            normal = mesh.face_normals[face]
            if normal[2] > -_DOWNWARD and _fits(rays, point, normal) and len(found) < count:
                found.append(touch_at(mesh, point, normal, len(found)))
    return tuple(found)


def _fits(rays: RayMesh, point: FloatArray, normal: FloatArray) -> bool:
    """Whether nothing of the body is in the housing that stands on the surface there."""
    frame = frame_facing(-normal, 0.0)
    x, y = np.meshgrid(np.linspace(-0.5, 0.5, 5) * HOUSING[0], np.linspace(-0.5, 0.5, 5) * HOUSING[1])
    face = point + 2.5e-3 * normal + x.reshape(-1, 1) * frame[:, 0] + y.reshape(-1, 1) * frame[:, 1]
    if face[:, 2].min() < 0.0:
        return False
    return bool(np.isinf(rays.first_hits(face, np.repeat(normal[None], len(face), axis=0)).distance).all())


def look_at(mesh: Mesh, width: int = 160) -> SeenMask:
    """The silhouette from 0.7 m away, 35 degrees above the support."""
    away = 0.7 * np.array([np.cos(0.6) * np.cos(-2.3), np.cos(0.6) * np.sin(-2.3), np.sin(0.6)])
    camera = Pinhole.looking_at(
        away, np.array([0.0, 0.0, 0.04]), np.array([0.0, 0.0, 1.0]), width, width * 3 // 4, 0.7
    )
    directions = camera.directions().reshape(-1, 3)
    hits = RayMesh(mesh).first_hits(np.repeat(camera.eye[None], len(directions), axis=0), directions)
    mask = np.isfinite(hits.distance).reshape(camera.height, camera.width)
    return SeenMask(
        mask=mask,
        hidden=np.zeros(mask.shape, bool),
        stand_from_camera=camera.object_from_camera,
        focal_length=camera.focal_px,
        position_error=2e-3,
        rotation_error=2e-3,
        focal_length_error=5e-3,
    )


def shape_readings(touches: tuple[GuardedTouch, ...], look: SeenMask | None) -> ShapeEvidence:
    """Evidence as a bench with a calibrated sensor would state it."""
    return ShapeEvidence(
        touches=touches,
        look=look,
        housing=HOUSING,
        gel_thickness=2.5e-3,
        housing_depth=0.12,
        place_error=20e-3,
        support_error=1e-3,
        largest=0.4,
    )


def missed(touch: GuardedTouch, stand_from_gel: FloatArray) -> GuardedTouch:
    """A way of the gel that met nothing."""
    nothing = read_only(np.empty((0, 3)))
    return GuardedTouch(stand_from_gel, touch.way, nothing, nothing, SIGMA, 0.1, touch.index)
