"""Which cells of a lattice hold some of a surface: each is to have a network."""

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.compiled import compiled
from harness.basics.errors import MeshRefused, WrongUse
from harness.basics.mesh import Mesh
from harness.objectfile.vision.network import CELLS, DEEP, PER_CELL, VisionGrid
from harness.objectfile.vision_tensors import MOST_CELLS

BOX = 1.2
"""Of the object's longest side: what ``cells`` go across, as the published grid's -0.6 to 0.6."""

_MARGIN = 1e-3
"""Of a cell, at least, between the object's box and the lattice's border."""

_WIDER = 1e-6 / PER_CELL
"""Enlargement of a cell, as a fraction of it, so that rounding drops no triangle that touches it."""


def surface_cells(mesh: Mesh, cells: int = CELLS) -> VisionGrid:
    """Find the cells that a surface touches, and those that it touches moved ``DEEP`` voxels inwards.

    Args:
        mesh: in metres.
        cells: along ``BOX`` times the longest side of its box.

    Raises:
        MeshRefused: no surface, or one that is not finite or all at one place.
        WrongUse: a number of cells that cannot be made.
    """
    if not 1 <= cells <= MOST_CELLS:
        raise WrongUse(f"{cells} cells along a side were asked for; 1 to {MOST_CELLS} are made")
    if len(mesh.faces) == 0 or not np.isfinite(mesh.corners).all():
        raise MeshRefused(f"a surface of {len(mesh.faces)} faces with finite corners has no shell; repair it")
    low, high = mesh.bounds
    longest = float((high - low).max())
    if not longest > 0.0:
        raise MeshRefused("a surface whose corners are all at one place has no shell; repair it")
    cell = longest * BOX / cells
    sides = np.maximum(np.ceil((high - low) / cell + 2.0 * _MARGIN), 1.0).astype(np.int64)
    corner = 0.5 * (low + high) - 0.5 * cell * sides
    marked = np.zeros(tuple(sides), np.bool_)
    for behind in (0.0, DEEP * cell / PER_CELL):
        moved = mesh.vertices - behind * mesh.vertex_normals
        _mark(np.ascontiguousarray((moved[mesh.faces] - corner) / cell), marked)
    return VisionGrid(corner, cell, np.argwhere(marked))


@compiled
def _mark(corners: FloatArray, marked: AnyArray) -> None:
    """Mark every cube that a triangle touches.

    Args:
        corners: ``(m, 3, 3)`` in cubes from the lattice's least corner; what lies outside marks nothing.
        marked: ``(x, y, z)`` booleans, written.
    """
    low, high = np.empty(3, np.int64), np.empty(3, np.int64)
    for m in range(len(corners)):
        face = corners[m]
        for axis in range(3):
            least = min(face[0, axis], face[1, axis], face[2, axis]) - _WIDER
            most = max(face[0, axis], face[1, axis], face[2, axis]) + _WIDER
            low[axis] = int(min(max(np.floor(least), 0.0), marked.shape[axis]))
            high[axis] = int(min(max(np.floor(most), -1.0), marked.shape[axis] - 1))
        for i in range(low[0], high[0] + 1):
            for j in range(low[1], high[1] + 1):
                for k in range(low[2], high[2] + 1):
                    marked[i, j, k] |= touches(face, i + 0.5, j + 0.5, k + 0.5)


@compiled
def touches(face: FloatArray, x: float, y: float, z: float) -> bool:
    """Tell whether a triangle ``(3, 3)`` touches the unit cube around a place: no axis separates them.

    After Akenine-Moeller (J. Graphics Tools 6(1), 2001).
    """
    half = 0.5 + _WIDER
    a = (face[0, 0] - x, face[0, 1] - y, face[0, 2] - z)
    b = (face[1, 0] - x, face[1, 1] - y, face[1, 2] - z)
    c = (face[2, 0] - x, face[2, 1] - y, face[2, 2] - z)
    for axis in range(3):
        if min(a[axis], b[axis], c[axis]) > half or max(a[axis], b[axis], c[axis]) < -half:
            return False
    e = (b[0] - a[0], b[1] - a[1], b[2] - a[2])
    f = (c[0] - b[0], c[1] - b[1], c[2] - b[2])
    g = (a[0] - c[0], a[1] - c[1], a[2] - c[2])
    nx, ny, nz = e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]
    if abs(nx * a[0] + ny * a[1] + nz * a[2]) > half * (abs(nx) + abs(ny) + abs(nz)):
        return False
    for edge in (e, f, g):
        for axis in range(3):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            p, q = -edge[v], edge[u]
            reach = half * (abs(p) + abs(q))
            pa, pb, pc = p * a[u] + q * a[v], p * b[u] + q * b[v], p * c[u] + q * c[v]
            if min(pa, pb, pc) > reach or max(pa, pb, pc) < -reach:
                return False
    return True
