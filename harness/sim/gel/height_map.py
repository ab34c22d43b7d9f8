"""What a flat window sees of a mesh: orthographic z-buffers, many poses at a time.

The sensor's effects and the estimators share these. Frames: ``gel`` as in
``harness.bench.sensor``; ``view`` is any frame whose z axis points from the eye to the object.
"""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import FloatArray, IntArray, read_only
from harness.basics.errors import OutOfDomain
from harness.basics.faces.face_clusters import cluster_faces
from harness.basics.mesh import Mesh
from harness.bench.sensor import TactileSensor
from harness.sim.gel.raster_kernels import Clusters, rasterise

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
