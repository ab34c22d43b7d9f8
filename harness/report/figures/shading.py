"""Soft, matt shading of what a camera sees: enough to read a shape at a glance.

The camera is a pinhole. What it calls the object's frame is here the world's, in which all bodies are placed.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter, maximum_filter, minimum_filter

from harness.basics.arrays import BoolArray, FloatArray, IntArray, block_means
from harness.basics.geometry import apply, inverse, transform
from harness.basics.mesh import Mesh
from harness.picture.pinhole import Pinhole
from harness.sim.gel.height_map import RasterMesh, depth_image

Paint = Callable[[FloatArray], tuple[FloatArray, FloatArray]]
"""``(n, 3)`` points of the world -> ``(n, 3)`` colours and ``(n,)`` how opaque they are."""

_CREASE = np.cos(np.radians(38.0))
_SLIVER = 0.01
_OVERSAMPLING = 2
_SHADOW_PIXELS = 800
_KEY, _FILL, _SKY, _BASE, _SHINE = 0.58, 0.22, 0.22, 0.20, 0.07

_BACKWARD = 0.02


@dataclass(frozen=True, eq=False)
class BenchPart:
    """A body in a picture."""

    mesh: Mesh  #: metres, in its own frame.
    base_from_part: FloatArray  #: ``(4, 4)``.
    colour: tuple[float, float, float]  #: red, green, blue from 0 to 1.
    smooth: bool = True  #: whether edges of less than 38 degrees are shaded as one smooth surface.


class Shot:
    """Bodies before a camera, lit once, to be coloured as often as one likes.

    Args:
        parts: the bodies.
        camera: its rows and columns are those of the pictures.
    """

    def __init__(self, parts: tuple[BenchPart, ...], camera: Pinhole) -> None:
        self.camera = camera
        fine = camera.resized(_OVERSAMPLING * camera.width, _OVERSAMPLING * camera.height)
        self._view = view = see(parts, fine)
        self._filled = filled = view.part >= 0
        if not filled.any():
            return
        self._points = back_projected(fine, np.where(filled, view.depth, 1.0))[filled]
        normals = _normals(view, parts, self._points, filled)
        self._owner = view.part[filled]
        self._albedo = np.array([part.colour for part in parts])[self._owner]
        lit = _lit(parts, self._points, normals, fine)
        self._light, self._shine = _light(normals, self._points, fine, lit)
        self._cue = _depth_cue(view)[filled]

    def hidden(self, points: FloatArray, clearance: float) -> BoolArray:
        """Whether each of ``(n, 3)`` points lies more than ``clearance`` metres behind what is seen."""
        pixels, depth = self._view.camera.project(points)
        column = np.clip(pixels[:, 0].astype(int), 0, self._view.camera.width - 1)
        row = np.clip(pixels[:, 1].astype(int), 0, self._view.camera.height - 1)
        return np.asarray(depth > self._view.depth[row, column] + clearance)

    def picture(self, painted: int = -1, paint: Paint | None = None) -> FloatArray:
        """``(rows, columns, 3)`` from 0 to 1, on white; ``paint`` colours body ``painted``."""
        picture = np.ones((*self._filled.shape, 3))
        if self._filled.any():
            albedo = self._albedo.copy()
            if paint is not None:
                own = self._owner == painted
                colour, opaque = paint(self._points[own])
                albedo[own] += opaque[:, None] * (colour - albedo[own])
            shade = self._light[:, None] * albedo + self._shine[:, None]
            picture[self._filled] = np.clip(shade, 0.0, 1.0) * self._cue[:, None]
        return block_means(picture, _OVERSAMPLING)


@dataclass(frozen=True, eq=False)
class CameraPicture:
    """What a camera sees, pixel by pixel."""

    camera: Pinhole  #: that saw it.
    depth: FloatArray  #: ``(rows, columns)`` metres; +inf where nothing is.
    part: IntArray  #: index of the body, -1 where nothing is.
    face: IntArray  #: index of that body's face.


def _normals(
    view: CameraPicture, parts: tuple[BenchPart, ...], points: FloatArray, filled: BoolArray
) -> FloatArray:
    """``(n, 3)`` shading normals in the world, turned towards the eye."""
    normals = np.zeros((len(points), 3))
    owner, face = view.part[filled], view.face[filled]
    for index, part in enumerate(parts):
        mine = owner == index
        if not mine.any():
            continue
        local = apply(inverse(part.base_from_part), points[mine])
        found = part.mesh.face_normals[face[mine]]
        if part.smooth:  # blended over each face from the normals at its corners
            at_corners = _corner_normals(part.mesh)[face[mine]]
            blended = np.einsum("nk,nki->ni", _shares(part.mesh.corners[face[mine]], local), at_corners)
            length = np.linalg.norm(blended, axis=1)
            found = np.where(length[:, None] > 0.1, blended / np.maximum(length, 0.1)[:, None], found)
        normals[mine] = found @ part.base_from_part[:3, :3].T
    away = view.camera.eye - points
    facing = np.where(np.einsum("ij,ij->i", normals, away) < 0.0, -1.0, 1.0)
    return normals * facing[:, None]


def _corner_normals(mesh: Mesh) -> FloatArray:
    """``(m, 3, 3)`` at each corner of each face: the mean of the faces there that bend less than a crease."""
    vertex = mesh.faces.ravel()
    by_vertex = np.argsort(vertex, kind="stable")
    count = np.bincount(vertex, minlength=len(mesh.vertices))
    valence = count[vertex]
    corner = np.repeat(np.arange(len(vertex)), valence)
    nth = np.arange(len(corner)) - np.repeat(np.cumsum(valence) - valence, valence)
    neighbour = by_vertex[np.repeat((np.cumsum(count) - count)[vertex], valence) + nth] // 3
    # A sliver's own normal is noise: it takes its neighbours' in any case.
    sliver = mesh.face_areas < _SLIVER * float(np.median(mesh.face_areas))
    bend = np.einsum("ij,ij->i", mesh.face_normals[corner // 3], mesh.face_normals[neighbour])
    joined = (bend > _CREASE) | sliver[corner // 3]
    weight = mesh.face_areas[neighbour[joined]]
    sums = [
        np.bincount(corner[joined], weight * mesh.face_normals[neighbour[joined], i], len(vertex))
        for i in range(3)
    ]
    total = np.column_stack(sums)
    unit: FloatArray = total / np.maximum(np.linalg.norm(total, axis=1), 1e-30)[:, None]
    return unit.reshape(-1, 3, 3)


def _shares(corners: FloatArray, points: FloatArray) -> FloatArray:
    """Barycentric coordinates ``(n, 3)``, kept within the triangle."""
    e1, e2, p = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], points - corners[:, 0]
    d11, d12, d22 = (np.einsum("ij,ij->i", a, b) for a, b in ((e1, e1), (e1, e2), (e2, e2)))
    d1, d2 = np.einsum("ij,ij->i", p, e1), np.einsum("ij,ij->i", p, e2)
    area = np.maximum(d11 * d22 - d12**2, 1e-30)
    v, w = (d22 * d1 - d12 * d2) / area, (d11 * d2 - d12 * d1) / area
    shares = np.clip(np.column_stack([1.0 - v - w, v, w]), 0.0, 1.0)
    return np.asarray(shares / shares.sum(axis=1)[:, None])


def _key_direction(camera: Pinhole) -> FloatArray:
    """Towards the main light: over the viewer's left shoulder."""
    right, down, forward = camera.camera_from_object[:3, :3]
    direction = -0.65 * right - 0.50 * down - 0.80 * forward
    return np.asarray(direction / np.linalg.norm(direction))


def _light(
    normals: FloatArray, points: FloatArray, camera: Pinhole, lit: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """``(n,)`` what the body's colour is multiplied by, and ``(n,)`` a soft highlight on top."""
    key = _key_direction(camera)
    away = camera.eye - points
    away /= np.linalg.norm(away, axis=1)[:, None]
    half = key + away
    half /= np.linalg.norm(half, axis=1)[:, None]
    towards = np.clip(normals @ key, 0.0, 1.0) * lit
    ahead = np.clip(np.einsum("ij,ij->i", normals, away), 0.0, 1.0)
    sky = 0.5 + 0.5 * normals[:, 2]
    gloss = np.clip(np.einsum("ij,ij->i", normals, half), 0.0, 1.0) ** 40 * lit
    return _BASE + _KEY * towards + _FILL * ahead + _SKY * sky, _SHINE * gloss


def _lit(
    parts: tuple[BenchPart, ...], points: FloatArray, normals: FloatArray, camera: Pinhole
) -> FloatArray:
    """``(n,)`` share of the main light that reaches each point: a blurred shadow map."""
    key = _key_direction(camera)
    aside = np.cross(key, [0.0, 0.0, 1.0])
    aside /= np.linalg.norm(aside)
    low, high = points.min(axis=0), points.max(axis=0)
    middle, span = 0.5 * (low + high), 1.05 * float(np.linalg.norm(high - low)) + 1e-6
    light_from_world = inverse(transform(np.column_stack([aside, np.cross(-key, aside), -key]), middle))
    pitch = span / _SHADOW_PIXELS
    nearest = np.full((_SHADOW_PIXELS, _SHADOW_PIXELS), np.inf)
    for part in parts:
        pose = light_from_world @ part.base_from_part
        image = depth_image(RasterMesh(part.mesh), pose, pitch, _SHADOW_PIXELS, _SHADOW_PIXELS)
        nearest = np.minimum(nearest, image.depth)
    local = apply(light_from_world, points + 2.0 * pitch * normals)
    lit = np.zeros(len(points))
    offsets = [(i, j) for i in (-2.0, 0.0, 2.0) for j in (-2.0, 0.0, 2.0)]
    for i, j in offsets:
        column = np.clip((local[:, 0] / pitch + 0.5 * _SHADOW_PIXELS + j).astype(int), 0, _SHADOW_PIXELS - 1)
        row = np.clip((local[:, 1] / pitch + 0.5 * _SHADOW_PIXELS + i).astype(int), 0, _SHADOW_PIXELS - 1)
        lit += local[:, 2] <= nearest[row, column] + 3.0 * pitch
    return lit / len(offsets)


def _depth_cue(view: CameraPicture) -> FloatArray:
    """Darkens what lies close behind something else, and outlines (Luft et al., SIGGRAPH 2006)."""
    filled = view.part >= 0
    least, most = view.depth[filled].min(), view.depth[filled].max()
    reach = max(float(most - least), 1e-6)
    depth = np.where(filled, view.depth, most)
    blurred = gaussian_filter(depth, 0.012 * view.camera.width)
    hollow = np.clip((depth - blurred) / (0.25 * reach), 0.0, 1.0)
    jump = maximum_filter(depth, 3) - minimum_filter(depth, 3) > 0.02 * reach
    border = maximum_filter(view.part, 3) != minimum_filter(view.part, 3)
    line = gaussian_filter((jump & border).astype(np.float64) + 0.45 * (jump ^ border), 0.7)
    return np.asarray((1.0 - 0.45 * hollow) * (1.0 - 0.55 * np.clip(line, 0.0, 1.0)))


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


def see(parts: tuple[BenchPart, ...], camera: Pinhole) -> CameraPicture:
    """Draw bodies into one depth buffer.

    Orthographic drawing of (x / z, y / z, -1 / z) is perspective drawing: that map keeps
    lines straight and nearer things nearer.
    """
    depth = np.full((camera.height, camera.width), np.inf)
    owner = np.full(depth.shape, -1, np.int64)
    face = np.full(depth.shape, -1, np.int64)
    for index, part in enumerate(parts):
        local = apply(camera.camera_from_object @ part.base_from_part, part.mesh.vertices)
        kept = np.flatnonzero((local[part.mesh.faces, 2] > _BACKWARD).all(axis=1))
        z = np.maximum(local[:, 2], _BACKWARD)
        warped, kept = (
            Mesh(np.column_stack([local[:, :2] / z[:, None], -1.0 / z]), part.mesh.faces[kept]),
            kept,
        )
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
