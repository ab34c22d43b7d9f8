"""A coarser surface for a page: faces of less than a pixel cost bytes and time, and show nothing."""

import numpy as np

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.mesh import Mesh

_FIRST_CELL = 2.0e-3
_WIDER = 1.2


def fewer_faces(mesh: Mesh, values: FloatArray, most: int) -> tuple[Mesh, FloatArray]:
    """A coarser surface to look at, and ``(vertices,)`` values on it: no more than ``most`` faces.

    Vertices of one cell of a grid that face one way become their mean, so that the two sides of a wall stay
    apart. The result need not be closed.

    Args:
        mesh: m.
        values: ``(vertices,)``.
        most: faces, a hundred or more.
    """
    cell = _FIRST_CELL
    found, carried = mesh, values
    while len(found.faces) > most:
        found, carried = _clustered(mesh, values, cell)
        cell *= _WIDER
    return found, carried


def _clustered(mesh: Mesh, values: FloatArray, cell: float) -> tuple[Mesh, FloatArray]:
    rows, normals = np.arange(len(mesh.vertices)), mesh.vertex_normals
    axis = np.abs(normals).argmax(axis=1)
    side = 2 * axis + (normals[rows, axis] > 0.0)
    keys = np.column_stack([np.floor(mesh.vertices / cell).astype(np.int64), side])
    _, cluster = np.unique(keys, axis=0, return_inverse=True)
    cluster = cluster.ravel()
    counts = np.bincount(cluster)
    columns = [np.bincount(cluster, column) / counts for column in (*mesh.vertices.T, values)]
    faces = cluster[mesh.faces]
    return Mesh(np.column_stack(columns[:3]), _without_slivers(faces)), np.asarray(columns[3])


def _without_slivers(faces: IntArray) -> IntArray:
    """Those that still have three corners."""
    a, b, c = faces.T
    return np.asarray(faces[(a != b) & (b != c) & (c != a)])
