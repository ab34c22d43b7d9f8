"""A pinhole looking at the bench, and what it sees of a set of bodies.

What the pinhole calls the object's frame is here the world's, in which all bodies are placed.
"""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.geometry import apply, transform
from harness.basics.mesh import Mesh
from harness.picture.pinhole import Pinhole
from harness.report.data import BenchPart
from harness.sim.gel.height_map import RasterMesh, depth_image

_BACKWARD = 0.02


def look_at(
    focus: FloatArray, azimuth: float, elevation: float, width: float, rows: int, columns: int
) -> Pinhole:
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
    middle = (0.5 * columns, 0.5 * rows)
    return Pinhole(columns, rows, columns * distance / width, middle, world_from_camera)


def back_projected(camera: Pinhole, depth: FloatArray) -> FloatArray:
    """``(rows, columns, 3)`` points of the world at ``(rows, columns)`` metres of depth."""
    x = (np.arange(camera.width) + 0.5 - camera.centre_px[0]) / camera.focal_px
    y = (np.arange(camera.height) + 0.5 - camera.centre_px[1]) / camera.focal_px
    local = np.stack([x[None, :] * depth, y[:, None] * depth, depth], axis=-1)
    return apply(camera.object_from_camera, local.reshape(-1, 3)).reshape(local.shape)


@dataclass(frozen=True, eq=False)
class CameraPicture:
    """What a camera sees, pixel by pixel.

    Attributes:
        camera: that saw it.
        depth: ``(rows, columns)`` metres; +inf where nothing is.
        part: index of the body, -1 where nothing is.
        face: index of that body's face.
    """

    camera: Pinhole
    depth: FloatArray
    part: IntArray
    face: IntArray


def see(parts: tuple[BenchPart, ...], camera: Pinhole) -> CameraPicture:
    """Draw bodies into one depth buffer.

    Orthographic drawing of (x / z, y / z, -1 / z) is perspective drawing: that map keeps
    lines straight and nearer things nearer.
    """
    depth = np.full((camera.height, camera.width), np.inf)
    owner = np.full(depth.shape, -1, np.int64)
    face = np.full(depth.shape, -1, np.int64)
    for index, part in enumerate(parts):
        warped, kept = _warped(part, camera)
        if len(warped.faces) == 0:
            continue
        image = depth_image(RasterMesh(warped), np.eye(4), 1.0 / camera.focal_px, camera.height, camera.width)
        seen = image.face >= 0
        distance = np.full(depth.shape, np.inf)
        distance[seen] = -1.0 / image.depth[seen]
        nearer = distance < depth
        depth[nearer], owner[nearer] = distance[nearer], index
        face[nearer] = kept[image.face[nearer]]
    return CameraPicture(camera, depth, owner, face)


def _warped(part: BenchPart, camera: Pinhole) -> tuple[Mesh, IntArray]:
    """The body before the eye, in the map that makes perspective orthographic, and its faces' indices."""
    local = apply(camera.camera_from_object @ part.base_from_part, part.mesh.vertices)
    kept = np.flatnonzero((local[part.mesh.faces, 2] > _BACKWARD).all(axis=1))
    z = np.maximum(local[:, 2], _BACKWARD)
    return Mesh(np.column_stack([local[:, :2] / z[:, None], -1.0 / z]), part.mesh.faces[kept]), kept
