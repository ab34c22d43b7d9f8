"""A mesh's faces in clusters of near neighbours, so that a small window asks only those about it."""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import FloatArray, IntArray, read_only
from harness.basics.compiled import compiled
from harness.basics.errors import MeshRefused
from harness.basics.mesh import Mesh

CLUSTER = 16
"""Faces to a cluster, and clusters to a group: a window of a tactile sensor meets about fifty clusters."""

_STEPS = 10
"""Halvings of the box along each axis by which faces are sorted."""

_WIDER = 1e-9
"""Of a box's greatest coordinate, by which it is widened, so that rounding in a view loses no face."""


@dataclass(frozen=True, eq=False)
class FaceClusters:
    """Every face once, beside its neighbours."""

    corners: FloatArray
    """``(clusters, 9, CLUSTER)`` metres: x, y and z of the first, second and third corner of each face, in
    the object's frame; NaN where the last cluster has no more faces."""
    faces: IntArray  #: ``(clusters, CLUSTER)`` which face of the mesh each is; -1 where there is none.
    boxes: FloatArray  #: ``(clusters, 6)`` metres: centre and half the size of the box around each cluster.
    groups: FloatArray  #: ``(groups, 6)`` the same of every ``CLUSTER`` clusters that follow one another.


def corners_to_raster(mesh: Mesh) -> FloatArray:
    """``(faces, 3, 3)`` metres; ``MeshRefused`` for no face, or a corner that is not finite."""
    corners = mesh.corners
    if len(corners) == 0 or not np.isfinite(corners).all():
        raise MeshRefused(
            f"cannot raster a mesh of {len(corners)} faces with finite corners; repair it first"
        )
    return corners


def cluster_faces(mesh: Mesh) -> FaceClusters:
    """Sort a mesh's faces along a curve through space (Morton's), and cut them into clusters.

    Raises:
        MeshRefused: no face, or a corner that is not finite.
    """
    corners = corners_to_raster(mesh)
    # Places along Morton's curve: the bits of x, y and z in turn.
    points = corners.mean(axis=1)
    start = points.min(axis=0)
    extent = max(float((points.max(axis=0) - start).max()), 1e-30)
    cells = np.minimum((points - start) / extent * 2**_STEPS, 2**_STEPS - 1).astype(np.int64)
    place = np.zeros(len(points), np.int64)
    for bit in range(_STEPS):
        for axis in range(3):
            place |= ((cells[:, axis] >> bit) & 1) << (3 * bit + axis)
    order = np.argsort(place, kind="stable")
    count = -(-len(order) // CLUSTER)
    spread = np.full((count * CLUSTER, 9), np.nan)
    spread[: len(order)] = corners[order].reshape(-1, 9)
    faces = np.full(count * CLUSTER, -1, np.int64)
    faces[: len(order)] = order
    columns = np.ascontiguousarray(spread.reshape(count, CLUSTER, 9).swapaxes(1, 2))
    ends = spread.reshape(count, CLUSTER * 3, 3)
    low, high = np.nanmin(ends, axis=1), np.nanmax(ends, axis=1)
    firsts = np.arange(0, count, CLUSTER)
    group_low, group_high = np.minimum.reduceat(low, firsts), np.maximum.reduceat(high, firsts)
    return FaceClusters(
        read_only(columns),
        read_only(faces.reshape(count, CLUSTER)),
        _boxes(low, high),
        _boxes(group_low, group_high),
    )


def _boxes(low: FloatArray, high: FloatArray) -> FloatArray:
    wider = _WIDER * np.maximum(np.abs(low), np.abs(high)).max(axis=1, keepdims=True)
    return read_only(np.concatenate([0.5 * (low + high), 0.5 * (high - low) + wider], axis=1))


@compiled
def clusters_in_box(
    view_from_object: FloatArray,
    low: FloatArray,
    high: FloatArray,
    boxes: FloatArray,
    groups: FloatArray,
    found: IntArray,
) -> int:
    """Write into ``found`` each cluster whose box may meet a box of the view's frame.

    Args:
        view_from_object: ``(4, 4)`` rigid.
        low: ``(3,)`` metres, the box's least corner in the view's frame; may be infinite.
        high: ``(3,)`` metres, its greatest.
        boxes: of the clusters.
        groups: of groups of them.
        found: ``(clusters,)``, overwritten.

    Returns:
        How many were found.
    """
    count = 0
    for g in range(len(groups)):
        if not _meets(view_from_object, low, high, groups[g]):
            continue
        for c in range(g * CLUSTER, min((g + 1) * CLUSTER, len(boxes))):
            if _meets(view_from_object, low, high, boxes[c]):
                found[count] = c
                count += 1
    return count


@compiled
def _meets(r: FloatArray, low: FloatArray, high: FloatArray, box: FloatArray) -> bool:
    # Along a view axis a box reaches half its sizes times the axis's parts.
    for a in range(3):
        middle = r[a, 0] * box[0] + r[a, 1] * box[1] + r[a, 2] * box[2] + r[a, 3]
        reach = abs(r[a, 0]) * box[3] + abs(r[a, 1]) * box[4] + abs(r[a, 2]) * box[5]
        if middle + reach < low[a] or middle - reach > high[a]:
            return False
    return True


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
