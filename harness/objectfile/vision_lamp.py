"""Whether a lamp far away sees places: its rays are parallel, so that faces are looked up on its own plane.

Faces are projected along the light once for a lamp, and listed by square cells of the plane across it. Of the
faces of one cell those stop a place's light that cover it and are nearer to the lamp.
"""

from dataclasses import dataclass

import numpy as np

from harness.arrays import AnyArray, BoolArray, FloatArray, IntArray
from harness.mesh import Mesh
from harness.sim.compiled import compiled

_ON_EDGE = 1e-9
"""Share of a face by which it is widened, as in ``ray_kernels``."""

_WIDER = 1e-6
"""Cells by which a face is widened where it is listed."""

_ALONG = 0.5
"""Cells along the grid for the root of the number of faces: more take longer to list, fewer to look up."""

_MOST = 32
"""Lists that a face is in, in the mean."""


@dataclass(frozen=True, eq=False)
class LampGrid:
    """The faces of a mesh as a lamp sees them.

    Attributes:
        turn: ``(3, 3)``: columns are two directions across the light, and the one towards the lamp.
        low: ``(2,)`` m, least corner of the grid across the light.
        cell: m, edge of a cell.
        starts: ``(rows * columns + 1,)`` int32: where each cell's list begins.
        faces: int32, listed.
        tops: ``(faces,)`` m: how near to the lamp each listed one reaches.
        corners: ``(m, 3, 3)`` m: of each face its first corner and the ways to the others, turned.
        columns: cells along the second direction.
    """

    turn: FloatArray
    low: FloatArray
    cell: float
    starts: AnyArray
    faces: AnyArray
    tops: FloatArray
    corners: FloatArray
    columns: int

    @classmethod
    def of(cls, mesh: Mesh, lamp: FloatArray, along: int | None = None) -> "LampGrid":
        """A mesh under a lamp.

        Args:
            mesh: in metres.
            lamp: ``(3,)`` unit, towards it.
            along: cells along the longer side; None for a few faces in each.
        """
        turn, count = _across(lamp), len(mesh.faces)
        turned, corners = mesh.vertices @ turn, np.empty((count, 3, 3))
        _cornered(turned, mesh.faces, corners)
        least, most = turned.min(axis=0)[:2], turned.max(axis=0)[:2]
        side = max(1, int(_ALONG * np.sqrt(count))) if along is None else along
        cell = max(float((most - least).max()) / side, np.finfo(np.float64).tiny)
        # Slivers across the whole of it would be listed nearly everywhere.
        while along is None and side > 1 and _listed(corners, least, cell) > _MOST * count:
            side, cell = side // 2, cell * side / (side // 2)
        low = least - _WIDER * cell
        rows, columns = (np.floor((most - low) / cell).astype(np.int64) + 1).tolist()
        starts = np.zeros(rows * columns + 1, np.int32)
        _count(corners, low, cell, columns, starts)
        listed, tops = np.empty(starts[-1], np.int32), np.empty(starts[-1])
        _list(corners, low, cell, columns, starts, listed, tops)
        return cls(turn, low, cell, starts, listed, tops, corners, columns)

    def sees(
        self, places: FloatArray, least: float, own: IntArray, faced: FloatArray, seen: BoolArray
    ) -> None:
        """Fill in whether nothing is between places and the lamp, of those that face it.

        Args:
            places: ``(n, 3)`` m.
            least: m, how much nearer to the lamp anything must be.
            own: ``(n,)`` face that each is on, which does not stop it; -1 where there is no place.
            faced: ``(n,)`` cosine, 0 where a place looks away.
            seen: ``(n,)`` written.
        """
        _sees(
            *(places, self.turn, least, own, faced, self.low, self.cell, self.columns, self.starts),
            *(self.faces, self.tops, self.corners, seen),
        )


def _across(lamp: FloatArray) -> FloatArray:
    """``(3, 3)`` rotation whose last column is a unit vector."""
    aside = np.zeros(3)
    aside[np.argmin(np.abs(lamp))] = 1.0
    one = np.cross(lamp, aside)
    one /= np.linalg.norm(one)
    return np.ascontiguousarray(np.column_stack([one, np.cross(lamp, one), lamp]))


@compiled
def _span(face: FloatArray, low: FloatArray, cell: float, axis: int) -> tuple[int, int]:
    """First and last cell of a face along an axis."""
    a = face[0, axis]
    least = a + min(0.0, min(face[1, axis], face[2, axis]))
    most = a + max(0.0, max(face[1, axis], face[2, axis]))
    first = int(max(np.floor((least - low[axis]) / cell - _WIDER), 0.0))
    return first, int(np.floor((most - low[axis]) / cell + _WIDER))


@compiled
def _cornered(turned: FloatArray, faces: IntArray, corners: FloatArray) -> None:
    """Fill in ``corners``."""
    for m in range(len(faces)):
        a, b, c = faces[m, 0], faces[m, 1], faces[m, 2]
        for axis in range(3):
            corners[m, 0, axis] = turned[a, axis]
            corners[m, 1, axis] = turned[b, axis] - turned[a, axis]
            corners[m, 2, axis] = turned[c, axis] - turned[a, axis]


@compiled
def _listed(corners: FloatArray, low: FloatArray, cell: float) -> int:
    """Places that the lists of all cells have together."""
    total = 0
    for m in range(len(corners)):
        i0, i1 = _span(corners[m], low, cell, 0)
        j0, j1 = _span(corners[m], low, cell, 1)
        total += (i1 - i0 + 1) * (j1 - j0 + 1)
    return total


@compiled
def _count(corners: FloatArray, low: FloatArray, cell: float, columns: int, starts: AnyArray) -> None:
    """Fill in where each cell's list begins."""
    rows = (len(starts) - 1) // columns
    for m in range(len(corners)):
        i0, i1 = _span(corners[m], low, cell, 0)
        j0, j1 = _span(corners[m], low, cell, 1)
        for i in range(i0, min(i1, rows - 1) + 1):
            for j in range(j0, min(j1, columns - 1) + 1):
                starts[i * columns + j + 1] += 1
    for n in range(1, len(starts)):
        starts[n] += starts[n - 1]


@compiled
def _list(
    corners: FloatArray,
    low: FloatArray,
    cell: float,
    columns: int,
    starts: AnyArray,
    listed: AnyArray,
    tops: FloatArray,
) -> None:
    """Fill in each cell's faces."""
    at, rows = starts.copy(), (len(starts) - 1) // columns
    for m in range(len(corners)):
        top = corners[m, 0, 2] + max(0.0, max(corners[m, 1, 2], corners[m, 2, 2]))
        i0, i1 = _span(corners[m], low, cell, 0)
        j0, j1 = _span(corners[m], low, cell, 1)
        for i in range(i0, min(i1, rows - 1) + 1):
            for j in range(j0, min(j1, columns - 1) + 1):
                n = at[i * columns + j]
                listed[n], tops[n] = m, top
                at[i * columns + j] = n + 1


@compiled
def _sees(
    places: FloatArray,
    turn: FloatArray,
    least: float,
    own: IntArray,
    faced: FloatArray,
    low: FloatArray,
    cell: float,
    columns: int,
    starts: AnyArray,
    listed: AnyArray,
    tops: FloatArray,
    corners: FloatArray,
    seen: BoolArray,
) -> None:
    """See ``LampGrid.sees``."""
    rows = (len(starts) - 1) // columns
    for n in range(len(places)):
        seen[n] = own[n] >= 0 and faced[n] > 0.0
        if not seen[n]:
            continue
        a, b, c = places[n, 0], places[n, 1], places[n, 2]
        x = a * turn[0, 0] + b * turn[1, 0] + c * turn[2, 0]
        y = a * turn[0, 1] + b * turn[1, 1] + c * turn[2, 1]
        above = a * turn[0, 2] + b * turn[1, 2] + c * turn[2, 2] + least
        i, j = int(np.floor((x - low[0]) / cell)), int(np.floor((y - low[1]) / cell))
        if not (0 <= i < rows and 0 <= j < columns):
            continue
        for k in range(starts[i * columns + j], starts[i * columns + j + 1]):
            if tops[k] > above and listed[k] != own[n] and _stops(corners[listed[k]], x, y, above):
                seen[n] = False
                break


@compiled
def _stops(face: FloatArray, x: float, y: float, above: float) -> bool:
    """Whether a turned face covers a place across the light, higher than ``above``."""
    area = face[1, 0] * face[2, 1] - face[1, 1] * face[2, 0]
    if area == 0.0:
        return False
    sx, sy = x - face[0, 0], y - face[0, 1]
    u = (sx * face[2, 1] - sy * face[2, 0]) / area
    v = (face[1, 0] * sy - face[1, 1] * sx) / area
    # Written so that a NaN of a face seen edge-on stops nothing.
    if not (u >= -_ON_EDGE and v >= -_ON_EDGE and u + v <= 1.0 + _ON_EDGE):
        return False
    return bool(face[0, 2] + u * face[1, 2] + v * face[2, 2] > above)
