"""Ten-node tetrahedra: corner and middle nodes, and the surface they make."""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.errors import MeshRefused
from harness.sim.solid.modal_kernels import EDGES, MASS_POINTS, STIFFNESS_POINTS, determinants, shape_slopes

FACES = np.array([(1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1)])
"""Corners of the face opposite each corner, outward where the cell is positively oriented."""

_CHECKED_AT = np.vstack([STIFFNESS_POINTS, MASS_POINTS, np.eye(4)])


@dataclass(frozen=True, eq=False)
class QuadraticMesh:
    """Tetrahedra with a node in the middle of every edge."""

    nodes: FloatArray  #: ``(n, 3)`` m; the corners first, in their old order.
    cells: IntArray  #: ``(c, 10)`` corners, and middles of the edges in the order of ``EDGES``.
    faces: IntArray  #: ``(f, 6)`` of the surface, outward: corners a, b, c and middles of ab, bc, ca.

    @property
    def triangles(self) -> IntArray:
        """``(4 f, 3)``: every face of the surface as four triangles of nodes, outward."""
        a, b, c, ab, bc, ca = self.faces.T
        parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        return np.concatenate([np.stack(part, axis=1) for part in parts])


def quadratic_mesh(nodes: FloatArray, cells: IntArray) -> QuadraticMesh:
    """Straight ten-node tetrahedra of four-node ones.

    Args:
        nodes: ``(n, 3)`` m, each the corner of some cell.
        cells: ``(c, 4)``, positively oriented.
    """
    pairs = np.sort(cells[:, EDGES], axis=2).reshape(-1, 2)
    keys = pairs[:, 0] * len(nodes) + pairs[:, 1]
    unique, which = np.unique(keys, return_inverse=True)
    ends = np.stack(np.divmod(unique, len(nodes)), axis=1)
    middles = nodes[ends].mean(axis=1)
    whole = np.concatenate([cells, len(nodes) + which.reshape(-1, 6)], axis=1)
    return QuadraticMesh(np.concatenate([nodes, middles]), whole, six_node_faces(whole))


def boundary_faces(cells: IntArray) -> IntArray:
    """``(f, 3)``: the faces that belong to one cell only, outward.

    Raises:
        MeshRefused: a face that more than two cells share.
    """
    faces = cells[:, FACES].reshape(-1, 3)
    _, first, counts = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    if (counts > 2).any():
        raise MeshRefused(
            f"{int((counts > 2).sum())} faces of the tetrahedra are shared by more than two of them; "
            "the volume mesh overlaps itself: mesh the object again"
        )
    return np.asarray(faces[np.sort(first[counts == 1])], dtype=np.int64)


def six_node_faces(cells: IntArray) -> IntArray:
    """``(f, 6)``: the faces that belong to one of ``(c, 10)`` cells only, as ``QuadraticMesh.faces``.

    Raises:
        MeshRefused: a face that more than two cells share.
    """
    count = int(cells.max()) + 1
    ends = np.sort(cells[:, EDGES], axis=2).reshape(-1, 2)
    edges, first = np.unique(ends[:, 0] * count + ends[:, 1], return_index=True)
    faces = boundary_faces(cells[:, :4])
    sides = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2), axis=2)
    middles = cells[:, 4:].ravel()[first[np.searchsorted(edges, sides[..., 0] * count + sides[..., 1])]]
    return np.concatenate([faces, middles], axis=1)


def middles_of(nodes: FloatArray, cells: IntArray, count: int) -> FloatArray:
    """``(count, 3)``: at the index of a middle node the middle of its edge, elsewhere zero."""
    middles = np.zeros((count, 3))
    middles[cells[:, 4:]] = nodes[cells[:, EDGES]].mean(axis=2)
    return middles


def least_determinant(mesh: QuadraticMesh) -> FloatArray:
    """``(c,)`` m^3: six times the volume that each cell would have if it were everywhere as at its worst."""
    least: FloatArray = determinants(mesh.nodes, mesh.cells, shape_slopes(_CHECKED_AT)).min(axis=1)
    return least
