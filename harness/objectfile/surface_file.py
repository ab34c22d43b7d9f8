"""A surface as a PLY file that any viewer opens and that is read without guessing.

Binary, little endian; coordinates are doubles, faces are triangles. The same mesh gives the same bytes.
(Turk, The PLY Polygon File Format, 1994.)
"""

import re

import numpy as np

from harness.basics.errors import MeshRefused
from harness.basics.mesh import Mesh

_HEADER = (
    "ply\nformat binary_little_endian 1.0\n"
    "element vertex {vertices}\nproperty double x\nproperty double y\nproperty double z\n"
    "element face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
)
_READ = re.compile(
    re.escape(_HEADER).replace(r"\{vertices\}", r"(\d{1,9})").replace(r"\{faces\}", r"(\d{1,9})")
)
_LONGEST_HEADER = 400
_FACE = np.dtype([("count", "u1"), ("corners", "<i4", 3)])
_VERTEX_BYTES = 24
_FARTHEST = 1e6
"""Metres from the origin; beyond it the digits of a millimetre are gone."""


def ply_bytes(mesh: Mesh) -> bytes:
    """The mesh as a file."""
    faces = np.zeros(len(mesh.faces), _FACE)
    faces["count"], faces["corners"] = 3, mesh.faces
    header = _HEADER.format(vertices=len(mesh.vertices), faces=len(mesh.faces))
    return header.encode() + mesh.vertices.astype("<f8").tobytes() + faces.tobytes()


def mesh_from_ply(data: bytes, name: str, metres_per_unit: float = 1.0) -> Mesh:
    """The mesh that ``ply_bytes`` wrote.

    Args:
        data: the file's bytes.
        name: of the file, for messages.
        metres_per_unit: of its numbers.

    Raises:
        MeshRefused: another kind of PLY, a file cut short, or numbers that are no surface.
    """
    head = _READ.match(data[:_LONGEST_HEADER].decode("latin-1"))
    if head is None:
        raise MeshRefused(
            f"{name} is not the PLY of an ObjectFile (binary, little endian, double x y z, triangles); "
            "build the object from that mesh with `touchstone object build`"
        )
    vertices, faces = int(head[1]), int(head[2])
    middle = head.end() + vertices * _VERTEX_BYTES
    if len(data) != middle + faces * _FACE.itemsize:
        raise MeshRefused(
            f"{name} has {len(data)} bytes where {vertices} vertices and {faces} faces take "
            f"{middle + faces * _FACE.itemsize}; copy it again"
        )
    points = np.frombuffer(data, "<f8", 3 * vertices, head.end()).reshape(-1, 3) * metres_per_unit
    triangles = np.frombuffer(data, _FACE, faces, middle)
    corners = triangles["corners"]
    if len(corners) == 0 or len(points) == 0:
        raise MeshRefused(f"{name} holds no triangle; build the object again")
    if (triangles["count"] != 3).any() or corners.min() < 0 or corners.max() >= len(points):
        raise MeshRefused(
            f"{name} has a face that is no triangle of its {len(points)} vertices; copy it again"
        )
    if not (np.abs(points) <= _FARTHEST).all():
        raise MeshRefused(f"{name} has a vertex that is not within {_FARTHEST:g} m; build the object again")
    mesh = Mesh(points, corners)
    if not mesh.face_areas.sum() > 0.0:
        raise MeshRefused(f"{name} has no surface: every face has zero area; build the object again")
    return mesh
