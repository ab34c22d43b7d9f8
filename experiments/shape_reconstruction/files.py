"""An answer as files that any viewer opens: PLY, OBJ and GLB painted by what is known, and points."""

import io
from pathlib import Path

import numpy as np
import trimesh

from experiments.shape_reconstruction.estimators.point_answer import PointEstimate
from experiments.shape_reconstruction.surface import ShapeEstimate
from harness.basics.arrays import ByteArray, FloatArray
from harness.basics.errors import DataRefused
from harness.basics.geometry import rotation_about, transform
from harness.basics.whole_file import write_bytes_whole
from harness.sim.solid.surface_samples import random_points

POINTS = 10_000
"""Of the file of points, even by area."""

PALE_AT = 10.0e-3
"""M of deviation, at and beyond which a place has the colour of the least known."""

_COLOURS = np.array([[27, 63, 174], [90, 170, 190], [246, 217, 168], [220, 61, 42]], dtype=np.float64)
"""From well known to hardly known, at even steps of deviation."""

_PLY_HEADER = (
    "ply\nformat binary_little_endian 1.0\n"
    "comment metres; z up, z = 0 at the support; deviation is one standard deviation in metres\n"
    "comment known_by: 0 supposed, 1 seen, 2 touched\n"
    "element vertex {vertices}\n"
    "property double x\nproperty double y\nproperty double z\n"
    "property float deviation\nproperty uchar known_by\n"
    "property uchar red\nproperty uchar green\nproperty uchar blue\n"
    "element face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
)
_PLY_VERTEX = np.dtype([("place", "<f8", 3), ("deviation", "<f4"), ("known_by", "u1"), ("colour", "u1", 3)])
_PLY_FACE = np.dtype([("count", "u1"), ("corners", "<i4", 3)])


def write_estimate(estimate: ShapeEstimate, folder: Path, name: str = "shape") -> dict[str, Path]:
    """``NAME.ply``, ``NAME.obj``, ``NAME.glb`` and ``NAME.npz`` in a folder, each whole or not at all.

    The same answer gives the same bytes. The GLB has y up, as its format demands; all others have ``stand``.

    Args:
        estimate: finite, with one face or more.
        folder: that there is.
        name: of the files, without what follows the point.

    Returns:
        The paths by their kind.

    Raises:
        DataRefused: numbers that are not finite or not one a vertex.
    """
    _require_whole(estimate)
    made = {
        "ply": ply_bytes_of(estimate),
        "obj": obj_bytes_of(estimate),
        "glb": glb_bytes_of(estimate),
        "npz": points_bytes_of(estimate),
    }
    paths = {kind: folder / f"{name}.{kind}" for kind in made}
    for kind, data in made.items():
        write_bytes_whole(paths[kind], data)
    return paths


def write_points(estimate: PointEstimate, path: Path) -> None:
    """The points of an answer that has no surface, as ``points`` of an ``.npz``."""
    write_bytes_whole(path, _npz_bytes({"points": estimate.points}))


def ply_bytes_of(estimate: ShapeEstimate) -> bytes:
    """Binary, little endian: each vertex with its deviation, by what it is known, and its colour."""
    mesh = estimate.mesh
    vertices, faces = np.zeros(len(mesh.vertices), _PLY_VERTEX), np.zeros(len(mesh.faces), _PLY_FACE)
    vertices["place"], vertices["deviation"] = mesh.vertices, estimate.deviation
    vertices["known_by"], vertices["colour"] = estimate.known_by, colours_of(estimate.deviation)
    faces["count"], faces["corners"] = 3, mesh.faces
    header = _PLY_HEADER.format(vertices=len(vertices), faces=len(faces))
    return header.encode() + vertices.tobytes() + faces.tobytes()


def obj_bytes_of(estimate: ShapeEstimate) -> bytes:
    """Text: each vertex with its colour behind it, as most viewers read them."""
    shares = colours_of(estimate.deviation) / 255.0
    rows = np.column_stack([estimate.mesh.vertices, shares])
    text = io.StringIO()
    text.write("# metres; z up, z = 0 at the support; colours by deviation\n")
    np.savetxt(text, rows, fmt="v %.9g %.9g %.9g %.4f %.4f %.4f")
    np.savetxt(text, estimate.mesh.faces + 1, fmt="f %d %d %d")
    return text.getvalue().encode()


def glb_bytes_of(estimate: ShapeEstimate) -> bytes:
    """Binary glTF 2.0, painted; metres, y up."""
    colours = np.column_stack([colours_of(estimate.deviation), np.full(len(estimate.deviation), 255)])
    body = trimesh.Trimesh(
        estimate.mesh.vertices,
        estimate.mesh.faces,
        vertex_colors=colours.astype(np.uint8),
        process=False,
    )
    y_up_from_stand = transform(rotation_about(np.array([1.0, 0.0, 0.0]), -0.5 * np.pi), np.zeros(3))
    scene = trimesh.Scene()
    scene.add_geometry(body, node_name="shape", geom_name="shape", transform=y_up_from_stand)
    return bytes(scene.export(file_type="glb"))  # type: ignore[no-untyped-call]


def points_bytes_of(estimate: ShapeEstimate) -> bytes:
    """``points``, ``normals``, ``deviation`` and ``known_by`` of places all over the surface."""
    points, faces = random_points(estimate.mesh, POINTS, np.random.default_rng(0))
    corners = estimate.mesh.faces[faces]
    nearest = np.linalg.norm(estimate.mesh.vertices[corners] - points[:, None], axis=2).argmin(axis=1)
    vertices = corners[np.arange(len(points)), nearest]
    return _npz_bytes(
        {
            "points": points,
            "normals": estimate.mesh.face_normals[faces],
            "deviation": estimate.deviation[vertices],
            "known_by": estimate.known_by[vertices].astype(np.float64),
        }
    )


def colours_of(deviation: FloatArray) -> ByteArray:
    """``(n, 3)`` RGB of ``(n,)`` m: blue where it is well known, red from ``PALE_AT`` on."""
    at = np.clip(deviation / PALE_AT, 0.0, 1.0) * (len(_COLOURS) - 1)
    steps = np.arange(len(_COLOURS))
    channels = [np.interp(at, steps, _COLOURS[:, channel]) for channel in range(3)]
    return np.round(np.column_stack(channels)).astype(np.uint8)


def _npz_bytes(arrays: dict[str, FloatArray]) -> bytes:
    stream = io.BytesIO()
    np.savez(stream, allow_pickle=False, **arrays)
    return stream.getvalue()


def _require_whole(estimate: ShapeEstimate) -> None:
    mesh = estimate.mesh
    count = len(mesh.vertices)
    finite = np.isfinite(mesh.vertices).all() and np.isfinite(estimate.deviation).all()
    if len(mesh.faces) == 0 or not finite or not len(estimate.deviation) == len(estimate.known_by) == count:
        raise DataRefused(
            f"an answer of {len(mesh.faces)} faces and {count} vertices with {len(estimate.deviation)} "
            f"deviations and {len(estimate.known_by)} sources is not written; give faces, and of every "
            "vertex one finite deviation and one source"
        )
