"""What a flat window sees of a mesh: orthographic z-buffers, many poses at a time.

The sensor's effects and the estimators share these. Frames: ``gel`` as in
``harness.bench.sensor``; ``view`` is any frame whose z axis points from the eye to the object.

Faces that look at the eye are drawn first. Those that look away are hidden behind them wherever a surface
is closed, and are asked for by the nearest depth that they could have against the farthest that
is drawn in squares of pixels; the least depth of a pixel's line is the same in any order.
"""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import FloatArray, IntArray, read_only
from harness.basics.compiled import compiled
from harness.basics.errors import OutOfDomain
from harness.basics.faces.face_clusters import CLUSTER, cluster_faces, clusters_in_box
from harness.basics.mesh import Mesh
from harness.bench.sensor import TactileSensor

Clusters = tuple[FloatArray, IntArray, FloatArray, FloatArray]

_SQUARE = 8
"""Width in pixels of the squares whose greatest depth is stored."""

ON_EDGE = 1e-7
"""Margin of a triangle in pixels, so that no line passes between two triangles that share an edge."""

Corners = tuple[float, float, float, float, float, float]
"""x and y of three corners in pixels, from the least y to the greatest."""

Steps = tuple[float, float, float]
"""Columns a row, along the edges from the first corner to the last and to the second, and between those."""


STAND_OFF = 50e-3
"""Metres behind the gel plane where its rays start: farther back is behind the sensor."""

SEARCH_DEPTH = 20e-3
"""Metres beyond the gel plane where its rays end: what is farther cannot be touched."""

_RIGID_TOLERANCE = 1e-6


class RasterMesh:
    """A mesh prepared once for any number of views; read-only and safe to share by threads."""

    mesh: Mesh  #: in metres, in the object's frame.
    clusters: Clusters  #: its faces by neighbourhood, as the z-buffer takes them.

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
        of = cluster_faces(mesh)
        self.clusters = of.corners, of.faces, of.boxes, of.groups


@dataclass(frozen=True, eq=False)
class DepthImage:
    """The first surface met along +z of a view."""

    depth: FloatArray  #: ``(rows, columns)`` metres, z in the view's frame; +inf where nothing is met.
    face: IntArray  #: ``(rows, columns)`` index of the mesh's face that is met, -1 where none is.


def height_maps(raster: RasterMesh, gel_from_object: FloatArray, sensor: TactileSensor) -> FloatArray:
    """The gap between the flat gel plane and the object, at every pixel of every contact.

    The value is the gel-frame z of the first surface along +z, from ``-STAND_OFF`` to ``SEARCH_DEPTH``:
    positive where the object is clear of the plane z = 0, negative where it reaches behind it.

    Args:
        raster: the object.
        gel_from_object: ``(n, 4, 4)`` rigid.
        sensor: gives rows, columns and pitch; its dome, if any, is not subtracted here.

    Returns:
        ``(n, rows, columns)`` metres, float64; +inf where there is no object.

    Raises:
        OutOfDomain: a pose that is not finite and rigid.
    """
    poses = rigid_poses(gel_from_object)
    gap = np.empty((len(poses), sensor.rows, sensor.columns))
    no_faces = np.empty((0, 0, 0), np.int64)
    corner = -0.5 * np.array(sensor.window)
    span = np.array([-STAND_OFF, SEARCH_DEPTH])
    rasterise(raster.clusters, poses, corner, sensor.pitch, span, gap, no_faces)
    return read_only(gap)


def penetration(gap: FloatArray, sensor: TactileSensor) -> FloatArray:
    """How deep the object reaches into the undeformed gel: the height map a rigid gel would show.

    Args:
        gap: ``(n, rows, columns)`` from ``height_maps``; +inf means no object.
        sensor: gives the dome.

    Returns:
        ``(n, rows, columns)`` metres, 0 or more, positive into the gel.

    Raises:
        OutOfDomain: a gap that is NaN or -inf.
    """
    bad = np.isnan(gap) | np.isneginf(gap)
    if bad.any():
        raise OutOfDomain(
            f"{int(bad.sum())} pixels of a height map are NaN or -inf (first in contact "
            f"{int(np.argwhere(bad)[0][0])}); a gap is a number of metres, or +inf where there is no object"
        )
    return read_only(np.maximum(0.0, rest_surface(sensor) - gap))


def rest_surface(sensor: TactileSensor) -> FloatArray:
    """``(rows, columns)`` metres: gel-frame z of the undeformed gel; 0 at its centre, a dome falls off.

    Raises:
        OutOfDomain: a dome too small to span the window.
    """
    if sensor.gel_radius is None:
        return read_only(np.zeros((sensor.rows, sensor.columns)))
    x = (np.arange(sensor.columns) + 0.5 - sensor.columns / 2) * sensor.pitch
    y = (np.arange(sensor.rows) + 0.5 - sensor.rows / 2) * sensor.pitch
    under = sensor.gel_radius**2 - (x[None, :] ** 2 + y[:, None] ** 2)
    if under.min() <= 0.0:
        raise OutOfDomain(
            f"a dome of radius {sensor.gel_radius * 1e3:g} mm does not span the window of {sensor.name}; "
            f"give its true radius, at least {np.hypot(*sensor.window) * 500:.1f} mm"
        )
    return read_only(np.sqrt(under) - sensor.gel_radius)


def depth_image(
    raster: RasterMesh,
    view_from_object: FloatArray,
    pitch: float,
    rows: int,
    columns: int,
    *,
    near: float = -np.inf,
    far: float = np.inf,
) -> DepthImage:
    """One orthographic picture, centred on the view's z axis.

    Pixel (i, j) is the line x = (j + 0.5 - columns / 2) * pitch, y = (i + 0.5 - rows / 2) * pitch.

    Args:
        raster: the object.
        view_from_object: ``(4, 4)`` rigid.
        pitch: metres a pixel, greater than zero.
        rows: pixels.
        columns: pixels.
        near: metres; surfaces of smaller z are not seen.
        far: metres; surfaces of greater z are not seen.

    Raises:
        OutOfDomain: a pose that is not finite and rigid, or a pitch that is not positive.
    """
    face = np.empty((1, rows, columns), np.int64)
    depth = _picture(raster, view_from_object, pitch, (rows, columns), (near, far), face)
    return DepthImage(depth, read_only(face[0]))


def first_surface(
    raster: RasterMesh, view_from_object: FloatArray, pitch: float, rows: int, columns: int
) -> FloatArray:
    """``(rows, columns)`` metres: the depth of ``depth_image`` alone, without whose it is.

    Raises:
        OutOfDomain: as ``depth_image`` does.
    """
    no_faces = np.empty((0, 0, 0), np.int64)
    return _picture(raster, view_from_object, pitch, (rows, columns), (-np.inf, np.inf), no_faces)


def _picture(
    raster: RasterMesh,
    view_from_object: FloatArray,
    pitch: float,
    shape: tuple[int, int],
    span: tuple[float, float],
    face: IntArray,
) -> FloatArray:
    if not (np.isfinite(pitch) and pitch > 0.0):
        raise OutOfDomain(f"a pixel of {pitch!r} m cannot be drawn; give a pitch greater than zero")
    poses = rigid_poses(np.asarray(view_from_object)[None])
    depth = np.empty((1, *shape))
    corner = -0.5 * pitch * np.array(shape[::-1], np.float64)
    rasterise(raster.clusters, poses, corner, pitch, np.array(span), depth, face)
    return read_only(depth[0])


def rigid_poses(poses: FloatArray) -> FloatArray:
    """``(n, 4, 4)`` poses as they are; ``OutOfDomain`` where one is not finite and rigid."""
    matrices = np.ascontiguousarray(poses, dtype=np.float64)
    if matrices.ndim != 3 or matrices.shape[1:] != (4, 4):
        raise OutOfDomain(f"poses of shape {matrices.shape} were given; a batch of poses is (n, 4, 4)")
    rotations = matrices[:, :3, :3]
    gram = np.swapaxes(rotations, 1, 2) @ rotations - np.eye(3)
    good = np.isfinite(matrices).all(axis=(1, 2)) & (np.abs(gram).max(axis=(1, 2)) < _RIGID_TOLERANCE)
    good &= np.linalg.det(np.where(good[:, None, None], rotations, -np.eye(3))) > 0.0
    if not good.all():
        worst = int(np.argmin(good))
        raise OutOfDomain(
            f"pose {worst} of {len(good)} is not a finite rigid transform; its rotation must be orthonormal, "
            f"right-handed, to {_RIGID_TOLERANCE:g}"
        )
    return matrices


@compiled
def rasterise(
    clusters: Clusters,
    view_from_object: FloatArray,
    corner: FloatArray,
    pitch: float,
    span: FloatArray,
    depth: FloatArray,
    face: IntArray,
) -> None:
    """Fill ``depth`` with the least z in ``span`` of each pixel's line, +inf where there is none.

    Args:
        clusters: corners, faces, boxes and groups of ``FaceClusters``.
        view_from_object: ``(n, 4, 4)`` rigid.
        corner: ``(2,)`` metres, x and y of the image's first corner.
        pitch: metres a pixel.
        span: ``(2,)`` metres, least and greatest z that is seen.
        depth: ``(n, rows, columns)``, overwritten.
        face: the same shape, overwritten with face indices or -1, of faces equally near the least; or empty,
            and left alone.
    """
    corners, faces, boxes, groups = clusters
    rows, columns = depth.shape[1], depth.shape[2]
    low = np.array([corner[0], corner[1], span[0]])
    high = np.array([corner[0] + columns * pitch, corner[1] + rows * pitch, span[1]])
    found = np.empty(len(boxes), np.int64)
    pixels = np.empty((9, CLUSTER))
    facing = np.empty(CLUSTER)
    farthest = np.empty(((rows + _SQUARE - 1) // _SQUARE, (columns + _SQUARE - 1) // _SQUARE))
    wants_face = face.size > 0
    for n in range(len(view_from_object)):
        image = depth[n]
        image[:] = np.inf
        if wants_face:
            face[n] = -1
        named = face[n] if wants_face else face[:, :, 0]
        count = clusters_in_box(view_from_object[n], low, high, boxes, groups, found)
        for away in range(2):
            if away:
                farthest[:] = np.nan
            for at in range(count):
                c = found[at]
                _to_pixels(corners[c], view_from_object[n], corner, pitch, pixels)
                _facing(pixels, span, rows, columns, facing)
                for k in range(CLUSTER):
                    if (facing[k] > 0.0) if away else (facing[k] < 0.0):
                        if away and _hidden(pixels, k, image, farthest):
                            continue
                        draw(pixels, k, facing[k], span, image, named, faces[c, k], wants_face)


@compiled
def _to_pixels(corners: FloatArray, r: FloatArray, corner: FloatArray, pitch: float, out: FloatArray) -> None:
    # Columns and rows such that pixel centres are whole numbers; z stays in metres.
    per_pixel = 1.0 / pitch
    for c in range(0, 9, 3):
        for k in range(CLUSTER):
            x, y, z = corners[c, k], corners[c + 1, k], corners[c + 2, k]
            out[c, k] = (r[0, 0] * x + r[0, 1] * y + r[0, 2] * z + r[0, 3] - corner[0]) * per_pixel - 0.5
            out[c + 1, k] = (r[1, 0] * x + r[1, 1] * y + r[1, 2] * z + r[1, 3] - corner[1]) * per_pixel - 0.5
            out[c + 2, k] = r[2, 0] * x + r[2, 1] * y + r[2, 2] * z + r[2, 3]


@compiled
def _facing(p: FloatArray, span: FloatArray, rows: int, columns: int, facing: FloatArray) -> None:
    """Twice the area of each face, below zero if it looks at the eye; 0 of what is not seen.

    What is edge-on is drawn by its neighbours. What is NaN is not seen either.
    """
    for k in range(CLUSTER):
        x_low, x_high = min(p[0, k], p[3, k], p[6, k]), max(p[0, k], p[3, k], p[6, k])
        y_low, y_high = min(p[1, k], p[4, k], p[7, k]), max(p[1, k], p[4, k], p[7, k])
        z_low, z_high = min(p[2, k], p[5, k], p[8, k]), max(p[2, k], p[5, k], p[8, k])
        seen = (
            (x_high >= -ON_EDGE)
            & (y_high >= -ON_EDGE)
            & (x_low <= columns - 1 + ON_EDGE)
            & (y_low <= rows - 1 + ON_EDGE)
            & (z_low <= span[1])
            & (z_high >= span[0])
        )
        ax, ay = p[3, k] - p[0, k], p[4, k] - p[1, k]
        bx, by = p[6, k] - p[0, k], p[7, k] - p[1, k]
        facing[k] = ax * by - bx * ay if seen else 0.0


@compiled
def _hidden(p: FloatArray, k: int, image: FloatArray, farthest: FloatArray) -> bool:
    """Test whether every pixel that a face may cover already has a nearer surface."""
    rows, columns = image.shape
    z_low = min(p[2, k], p[5, k], p[8, k])
    top = max(int(np.ceil(min(p[1, k], p[4, k], p[7, k]) - ON_EDGE)), 0)
    bottom = min(int(np.floor(max(p[1, k], p[4, k], p[7, k]) + ON_EDGE)), rows - 1)
    left = max(int(np.ceil(min(p[0, k], p[3, k], p[6, k]) - ON_EDGE)), 0)
    right = min(int(np.floor(max(p[0, k], p[3, k], p[6, k]) + ON_EDGE)), columns - 1)
    for i in range(top // _SQUARE, bottom // _SQUARE + 1):
        for j in range(left // _SQUARE, right // _SQUARE + 1):
            if np.isnan(farthest[i, j]):
                farthest[i, j] = _farthest(image, i * _SQUARE, j * _SQUARE)
            if z_low <= farthest[i, j]:
                return False
    return True


@compiled
def _farthest(image: FloatArray, top: int, left: int) -> float:
    most = -np.inf
    for i in range(top, min(top + _SQUARE, image.shape[0])):
        for j in range(left, min(left + _SQUARE, image.shape[1])):
            most = max(most, image[i, j])
    return most


@compiled
def draw(
    p: FloatArray,
    k: int,
    area: float,
    span: FloatArray,
    depth: FloatArray,
    face: IntArray,
    index: int,
    wants_face: bool,
) -> None:
    """Hold the depth of every pixel in a triangle to its own where that is nearer.

    Args:
        p: ``(9, n)`` x and y in pixels, whole at their centres, and z in metres of each corner in turn.
        k: which of the n.
        area: twice the triangle's own, in pixels, with its sign; not 0.
        span: ``(2,)`` metres, least and greatest z that is seen.
        depth: ``(rows, columns)`` metres, overwritten.
        face: the same shape, the least index of the nearest; or anything, and left alone.
        index: of the triangle.
        wants_face: whether ``face`` is written.
    """
    rows, columns = depth.shape
    corners = _sorted(p, k)
    steps = _steps(corners)
    z_low, z_high = min(p[2, k], p[5, k], p[8, k]), max(p[2, k], p[5, k], p[8, k])
    ax, ay, az = p[3, k] - p[0, k], p[4, k] - p[1, k], p[5, k] - p[2, k]
    bx, by, bz = p[6, k] - p[0, k], p[7, k] - p[1, k], p[8, k] - p[2, k]
    slope_x, slope_y = (az * by - bz * ay) / area, (bz * ax - az * bx) / area
    quick = z_low >= span[0] and z_high <= span[1] and not wants_face
    top = max(int(np.ceil(corners[1] - ON_EDGE)), 0)
    for i in range(top, min(int(np.floor(corners[5] + ON_EDGE)), rows - 1) + 1):
        first, last = _columns(i, columns, corners, steps)
        if first > last:
            continue
        z_row = p[2, k] + slope_y * (i - p[1, k]) - slope_x * p[0, k]
        if quick:
            z_first = z_row + slope_x * first
            for j in range(first, last + 1):
                z = z_first + slope_x * (j - first)
                z = z if z > z_low else z_low
                z = z if z < z_high else z_high
                depth[i, j] = z if z < depth[i, j] else depth[i, j]
            continue
        for j in range(first, last + 1):
            z = min(max(z_row + slope_x * j, z_low), z_high)
            if z < span[0] or z > span[1] or z > depth[i, j]:
                continue
            if wants_face:
                face[i, j] = index if z < depth[i, j] else min(index, face[i, j])
            depth[i, j] = z


@compiled
def _sorted(p: FloatArray, k: int) -> Corners:
    a, b, c = 0, 3, 6
    if p[a + 1, k] > p[b + 1, k]:
        a, b = b, a
    if p[b + 1, k] > p[c + 1, k]:
        b, c = c, b
    if p[a + 1, k] > p[b + 1, k]:
        a, b = b, a
    return p[a, k], p[a + 1, k], p[b, k], p[b + 1, k], p[c, k], p[c + 1, k]


@compiled
def _steps(of: Corners) -> Steps:
    # From the lower end up, so that two triangles compute a shared edge alike, to the bit.
    xa, ya, xb, yb, xc, yc = of
    return _step(xa, ya, xc, yc), _step(xa, ya, xb, yb), _step(xb, yb, xc, yc)


@compiled
def _step(x0: float, y0: float, x1: float, y1: float) -> float:
    height = y1 - y0
    return (x1 - x0) / height if height > ON_EDGE else 0.0


@compiled
def _columns(i: int, columns: int, of: Corners, steps: Steps) -> tuple[int, int]:
    """The first and the last column of a row; the last before the first where there is none."""
    xa, ya, xb, yb, xc, yc = of
    x_low, x_high = min(xa, xb, xc), max(xa, xb, xc)
    left, right = _reach(i, xa, ya, xc, yc, steps[0], x_high, x_low)
    # An edge counts a little past its ends: beside a corner both that end there do.
    if i <= yb + ON_EDGE:
        left, right = _reach(i, xa, ya, xb, yb, steps[1], left, right)
    if i >= yb - ON_EDGE:
        left, right = _reach(i, xb, yb, xc, yc, steps[2], left, right)
    first = int(np.ceil(max(left, x_low, 0.0) - ON_EDGE))
    last = int(np.floor(min(right, x_high, columns - 1.0) + ON_EDGE))
    return first, last


@compiled
def _reach(
    i: int, x0: float, y0: float, x1: float, y1: float, step: float, left: float, right: float
) -> tuple[float, float]:
    if y1 - y0 <= ON_EDGE:
        return min(left, x0, x1), max(right, x0, x1)
    x = x0 + (i - y0) * step
    return min(left, x), max(right, x)
