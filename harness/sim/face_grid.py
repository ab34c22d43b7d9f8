"""A uniform grid of a mesh's faces, so that a small window asks only its neighbourhood."""

from dataclasses import dataclass

import numpy as np

from harness.arrays import FloatArray, IntArray, read_only
from harness.errors import MeshRefused
from harness.mesh import Mesh
from harness.sim.compiled import compiled

_MOST_CELLS_A_SIDE = 64


@dataclass(frozen=True, eq=False)
class FaceGrid:
    """Which faces may pass through each cell of a box around the mesh.

    Attributes:
        origin: ``(3,)`` metres, the box's least corner, in the object's frame.
        cell: metres, the edge of a cell.
        shape: ``(3,)`` cells along x, y, z.
        starts: ``(cells + 1,)`` where each cell's list begins in ``faces``.
        faces: indices of faces whose bounding box meets the cell.
    """

    origin: FloatArray
    cell: float
    shape: IntArray
    starts: IntArray
    faces: IntArray


def build_face_grid(mesh: Mesh) -> FaceGrid:
    """Sort a mesh's faces into cells about two edges wide, at most 64 along a side.

    Raises:
        MeshRefused: no face, or a corner that is not finite.
    """
    corners = mesh.corners
    if len(corners) == 0 or not np.isfinite(corners).all():
        raise MeshRefused(
            f"cannot raster a mesh of {len(corners)} faces with finite corners; repair it first"
        )
    low, high = corners.min(axis=1), corners.max(axis=1)
    origin = low.min(axis=0)
    extent = high.max(axis=0) - origin
    typical = 2.0 * float(np.median((high - low).max(axis=1)))
    cell = max(typical, float(extent.max()) / _MOST_CELLS_A_SIDE, 1e-9)
    shape = np.maximum(np.floor(extent / cell).astype(np.int64) + 1, 1)
    first = np.minimum(((low - origin) / cell).astype(np.int64), shape - 1)
    last = np.minimum(((high - origin) / cell).astype(np.int64), shape - 1)
    starts, faces = _lists(first, last, shape)
    return FaceGrid(read_only(origin), cell, read_only(shape), read_only(starts), read_only(faces))


@compiled
def _lists(first: IntArray, last: IntArray, shape: IntArray) -> tuple[IntArray, IntArray]:
    starts = np.zeros(shape[0] * shape[1] * shape[2] + 1, np.int64)
    for f in range(len(first)):
        for i in range(first[f, 0], last[f, 0] + 1):
            for j in range(first[f, 1], last[f, 1] + 1):
                for k in range(first[f, 2], last[f, 2] + 1):
                    starts[(i * shape[1] + j) * shape[2] + k + 1] += 1
    starts = np.cumsum(starts)
    filled = starts.copy()
    faces = np.empty(starts[-1], np.int64)
    for f in range(len(first)):
        for i in range(first[f, 0], last[f, 0] + 1):
            for j in range(first[f, 1], last[f, 1] + 1):
                for k in range(first[f, 2], last[f, 2] + 1):
                    c = (i * shape[1] + j) * shape[2] + k
                    faces[filled[c]] = f
                    filled[c] += 1
    return starts, faces


@compiled
def faces_in_box(
    view_from_object: FloatArray,
    low: FloatArray,
    high: FloatArray,
    origin: FloatArray,
    cell: float,
    shape: IntArray,
    starts: IntArray,
    faces: IntArray,
    stamp: int,
    stamps: IntArray,
    found: IntArray,
) -> int:
    """Write into ``found`` each face of a cell that may meet a box of the view's frame.

    Args:
        view_from_object: ``(4, 4)`` rigid.
        low: ``(3,)`` metres, the box's least corner in the view's frame; may be infinite.
        high: ``(3,)`` metres, its greatest.
        origin: of the grid, and so are ``cell``, ``shape``, ``starts``, ``faces``.
        cell: metres.
        shape: cells along each side.
        starts: see ``FaceGrid``.
        faces: see ``FaceGrid``.
        stamp: a number not yet in ``stamps``.
        stamps: ``(faces,)``, remembers which faces were found; overwritten.
        found: ``(faces,)``, overwritten.

    Returns:
        How many were found.
    """
    count = 0
    r = view_from_object
    # A cell is a cube; along a view axis it reaches half its edge times the 1-norm of that axis.
    ex = 0.5 * cell * (abs(r[0, 0]) + abs(r[0, 1]) + abs(r[0, 2]))
    ey = 0.5 * cell * (abs(r[1, 0]) + abs(r[1, 1]) + abs(r[1, 2]))
    ez = 0.5 * cell * (abs(r[2, 0]) + abs(r[2, 1]) + abs(r[2, 2]))
    for i in range(shape[0]):
        x = origin[0] + (i + 0.5) * cell
        for j in range(shape[1]):
            y = origin[1] + (j + 0.5) * cell
            u0 = r[0, 0] * x + r[0, 1] * y + r[0, 3]
            v0 = r[1, 0] * x + r[1, 1] * y + r[1, 3]
            w0 = r[2, 0] * x + r[2, 1] * y + r[2, 3]
            for k in range(shape[2]):
                c = (i * shape[1] + j) * shape[2] + k
                if starts[c] == starts[c + 1]:
                    continue
                z = origin[2] + (k + 0.5) * cell
                u = u0 + r[0, 2] * z
                if u + ex < low[0] or u - ex > high[0]:
                    continue
                v = v0 + r[1, 2] * z
                if v + ey < low[1] or v - ey > high[1]:
                    continue
                w = w0 + r[2, 2] * z
                if w + ez < low[2] or w - ez > high[2]:
                    continue
                for at in range(starts[c], starts[c + 1]):
                    f = faces[at]
                    if stamps[f] != stamp:
                        stamps[f] = stamp
                        found[count] = f
                        count += 1
    return count
