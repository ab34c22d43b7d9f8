"""A pinhole looking at the bench, and what it sees of a set of bodies."""

from dataclasses import dataclass

import numpy as np

from harness.arrays import FloatArray, IntArray
from harness.geometry import apply, inverse, transform
from harness.mesh import Mesh
from harness.report.data import Part
from harness.sim.height_map import RasterMesh, depth_image

_BACKWARD = 0.02


@dataclass(frozen=True, eq=False)
class Camera:
    """Pixel (row i, column j) has its centre at (j + 0.5, i + 0.5).

    Attributes:
        camera_from_world: ``(4, 4)``; x right, y down, z forward.
        focal: pixels.
        rows: pixels.
        columns: pixels.
    """

    camera_from_world: FloatArray
    focal: float
    rows: int
    columns: int

    @property
    def eye(self) -> FloatArray:
        """``(3,)`` metres, in the world."""
        return np.asarray(inverse(self.camera_from_world)[:3, 3])

    def project(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """``(n, 2)`` pixels (x, y) and ``(n,)`` metres of depth, of ``(n, 3)`` points of the world."""
        local = apply(self.camera_from_world, points)
        offset = np.array([0.5 * self.columns, 0.5 * self.rows])
        return self.focal * local[:, :2] / local[:, 2:] + offset, local[:, 2]

    def back_projected(self, depth: FloatArray) -> FloatArray:
        """``(rows, columns, 3)`` points of the world at ``(rows, columns)`` metres of depth."""
        x = (np.arange(self.columns) + 0.5 - 0.5 * self.columns) / self.focal
        y = (np.arange(self.rows) + 0.5 - 0.5 * self.rows) / self.focal
        local = np.stack([x[None, :] * depth, y[:, None] * depth, depth], axis=-1)
        return apply(inverse(self.camera_from_world), local.reshape(-1, 3)).reshape(local.shape)


def look_at(
    focus: FloatArray, azimuth: float, elevation: float, width: float, rows: int, columns: int
) -> Camera:
    """A camera four picture widths away from what it looks at.

    Args:
        focus: ``(3,)`` metres, at the centre of the picture.
        azimuth: rad, bearing of the eye about z from x.
        elevation: rad above the horizontal, within a right angle.
        width: metres across the picture at the focus.
        rows: pixels.
        columns: pixels.
    """
    distance = 4.0 * width
    away = np.array(
        [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    )
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    down = np.cross(-away, right)
    world_from_camera = transform(np.column_stack([right, down, -away]), focus + distance * away)
    return Camera(inverse(world_from_camera), columns * distance / width, rows, columns)


@dataclass(frozen=True, eq=False)
class View:
    """What a camera sees, pixel by pixel.

    Attributes:
        camera: that saw it.
        depth: ``(rows, columns)`` metres; +inf where nothing is.
        part: index of the body, -1 where nothing is.
        face: index of that body's face.
    """

    camera: Camera
    depth: FloatArray
    part: IntArray
    face: IntArray


def see(parts: tuple[Part, ...], camera: Camera) -> View:
    """Draw bodies into one depth buffer.

    Orthographic drawing of (x / z, y / z, -1 / z) is perspective drawing: that map keeps
    lines straight and nearer things nearer.
    """
    depth = np.full((camera.rows, camera.columns), np.inf)
    owner = np.full(depth.shape, -1, np.int64)
    face = np.full(depth.shape, -1, np.int64)
    for index, part in enumerate(parts):
        warped, kept = _warped(part, camera)
        if len(warped.faces) == 0:
            continue
        image = depth_image(RasterMesh(warped), np.eye(4), 1.0 / camera.focal, camera.rows, camera.columns)
        seen = image.face >= 0
        distance = np.full(depth.shape, np.inf)
        distance[seen] = -1.0 / image.depth[seen]
        nearer = distance < depth
        depth[nearer], owner[nearer] = distance[nearer], index
        face[nearer] = kept[image.face[nearer]]
    return View(camera, depth, owner, face)


def _warped(part: Part, camera: Camera) -> tuple[Mesh, IntArray]:
    """The body before the eye, in the map that makes perspective orthographic, and its faces' indices."""
    local = apply(camera.camera_from_world @ part.base_from_part, part.mesh.vertices)
    kept = np.flatnonzero((local[part.mesh.faces, 2] > _BACKWARD).all(axis=1))
    z = np.maximum(local[:, 2], _BACKWARD)
    return Mesh(np.column_stack([local[:, :2] / z[:, None], -1.0 / z]), part.mesh.faces[kept]), kept
