"""A uniform grid of a mesh's faces, so that a ray or a point asks only its neighbourhood."""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import FloatArray, IntArray, read_only
from harness.basics.compiled import compiled
from harness.basics.faces.face_clusters import corners_to_raster
from harness.basics.mesh import Mesh

_MOST_CELLS_A_SIDE = 64


@dataclass(frozen=True, eq=False)
class FaceGrid:
    """Which faces may pass through each cell of a box around the mesh."""

    origin: FloatArray  #: ``(3,)`` metres, the box's least corner, in the object's frame.
    cell: float  #: metres, the edge of a cell.
    shape: IntArray  #: ``(3,)`` cells along x, y, z.
    starts: IntArray  #: ``(cells + 1,)`` where each cell's list begins in ``faces``.
    faces: IntArray  #: indices of faces whose bounding box meets the cell.


def build_face_grid(mesh: Mesh) -> FaceGrid:
    """Sort a mesh's faces into cells about two edges wide, at most 64 along a side.

    Raises:
        MeshRefused: no face, or a corner that is not finite.
    """
    corners = corners_to_raster(mesh)
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
