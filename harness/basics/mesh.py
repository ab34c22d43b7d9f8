"""A surface in metres: the one form in which every simulator takes an object."""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from harness.basics.arrays import FloatArray, IntArray, read_only


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles with shared vertices, outward by the right-hand rule."""

    key_name: ClassVar[str] = "harness.basics.mesh.Mesh"

    vertices: FloatArray  #: ``(n, 3)`` metres, in the object's frame.
    faces: IntArray  #: ``(m, 3)`` indices into the vertices.

    def __post_init__(self) -> None:
        vertices = np.ascontiguousarray(self.vertices, dtype=np.float64)
        faces = np.ascontiguousarray(self.faces, dtype=np.int64)
        object.__setattr__(self, "vertices", read_only(vertices.copy()))
        object.__setattr__(self, "faces", read_only(faces.copy()))

    @cached_property
    def corners(self) -> FloatArray:
        """``(m, 3, 3)`` metres: the three corners of every face."""
        return read_only(self.vertices[self.faces])

    @cached_property
    def face_normals(self) -> FloatArray:
        """``(m, 3)`` unit outward normals; zero for a face without area."""
        return read_only(_divide(self._crosses, np.linalg.norm(self._crosses, axis=1)))

    @cached_property
    def face_areas(self) -> FloatArray:
        """``(m,)`` square metres."""
        return read_only(0.5 * np.linalg.norm(self._crosses, axis=1))

    @cached_property
    def _crosses(self) -> FloatArray:
        a, b, c = self.corners[:, 0], self.corners[:, 1], self.corners[:, 2]
        return np.cross(b - a, c - a)

    @cached_property
    def vertex_normals(self) -> FloatArray:
        """``(n, 3)`` area-weighted unit normals."""
        total = np.zeros_like(self.vertices)
        for corner in range(3):
            np.add.at(total, self.faces[:, corner], self._crosses)
        return read_only(_divide(total, np.linalg.norm(total, axis=1)))

    @cached_property
    def bounds(self) -> FloatArray:
        """``(2, 3)`` metres: least and greatest corner of the axis-aligned box."""
        is_used = np.zeros(len(self.vertices), np.bool_)
        is_used[self.faces] = True
        used = self.vertices[is_used]
        return read_only(np.array([used.min(axis=0), used.max(axis=0)]))

    @property
    def diagonal(self) -> float:
        """Length of the bounding box's diagonal in metres."""
        return float(np.linalg.norm(self.bounds[1] - self.bounds[0]))


def signed_volume(mesh: Mesh) -> float:
    """Compute the volume inside a closed mesh in m^3; negative if its faces point inward."""
    # Seen from a vertex: far from the origin the terms of the sum would cancel.
    a, b, c = (mesh.corners[:, corner] - mesh.vertices[0] for corner in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


def _divide(vectors: FloatArray, lengths: FloatArray) -> FloatArray:
    safe = np.where(lengths > 0.0, lengths, 1.0)
    quotient: FloatArray = vectors / safe[:, None]
    return quotient


def hull_of(points: FloatArray) -> FloatArray:
    """``(m, d)`` those of ``(n, d)`` points that span their convex hull; all of a flat set."""
    try:
        return points[ConvexHull(points - points[0]).vertices]
    except QhullError:
        return np.unique(points, axis=0)


def closed_hull(points: FloatArray) -> Mesh:
    """The convex hull of ``(n, 3)`` points, its faces looking outward."""
    hull = ConvexHull(points - points[0])
    used, faces = np.unique(hull.simplices, return_inverse=True)
    faces = faces.reshape(hull.simplices.shape)
    corners = points[used][faces]
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inside = np.einsum("ij,ij->i", outward, hull.equations[:, :3]) < 0.0
    faces[inside] = faces[inside][:, ::-1]
    return Mesh(points[used], faces)
