"""Whether a lamp far away sees places: its rays are parallel, so that faces are looked up on its own plane.

Faces are projected along the light once for a lamp, and listed by square cells of the plane across it. Of the
faces of one cell those stop a place's light that cover it and are nearer to the lamp.

Light that leaves a place outside of a closed surface and is stopped enters the surface first, through a face
that looks away from the lamp: such are all that must be listed for it, and few places have one above them. A
place's own face is one of them if the place was lifted from it: what enters there leaves through another.
"""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import AnyArray, BoolArray, FloatArray, IntArray
from harness.basics.compiled import compiled
from harness.basics.mesh import Mesh

_ON_EDGE = 1e-9
"""Share of a face by which it is widened, as in ``ray_kernels``."""

_WIDER = 1e-6
"""Cells by which a face is widened where it is listed."""

_ALONG = 0.35
"""Cells along the grid for the root of the number of faces: more take longer to list, fewer to look up."""

_MOST = 32
"""Lists that a face is in, in the mean."""


Lists = tuple[
    FloatArray, FloatArray, float, int, AnyArray, FloatArray, AnyArray, FloatArray, FloatArray, AnyArray
]
"""Of a ``LampGrid``: turn, low, cell, columns, starts, most, listed, tops, turned and faces."""


@dataclass(frozen=True, eq=False)
class LampGrid:
    """The faces of a mesh as a lamp sees them.

    Attributes:
        turn: ``(3, 3)``: columns are two directions across the light, and the one towards the lamp.
        low: ``(2,)`` m, least corner of the grid across the light.
        cell: m, edge of a cell.
        starts: ``(rows * columns + 1,)`` int32: where each cell's list begins.
        most: ``(rows * columns,)`` m: how near to the lamp any face of a cell reaches.
        listed: int32 faces.
        tops: ``(listed,)`` m: how near to the lamp each listed one reaches.
        turned: ``(n, 3)`` m, the mesh's vertices.
        faces: ``(m, 3)`` the mesh's.
        columns: cells along the second direction.
        from_outside: whether only such faces are listed as look away from the lamp.
    """

    turn: FloatArray
    low: FloatArray
    cell: float
    starts: AnyArray
    most: FloatArray
    listed: AnyArray
    tops: FloatArray
    turned: FloatArray
    faces: AnyArray
    columns: int
    from_outside: bool

    @classmethod
    def of(
        cls, mesh: Mesh, lamp: FloatArray, along: int | None = None, from_outside: bool = False
    ) -> "LampGrid":
        """A mesh under a lamp.

        Args:
            mesh: in metres.
            lamp: ``(3,)`` unit, towards it.
            along: cells along the longer side; None for a few faces in each.
            from_outside: whether the mesh is closed and only places outside of it will be asked for.
        """
        turn, count = _across(lamp), len(mesh.faces)
        turned = mesh.vertices @ turn
        least, most = _reach(turned)
        side = max(1, int(_ALONG * np.sqrt(count))) if along is None else along
        spans = np.empty((count, 4), np.int32)
        while True:
            cell = max(float((most - least).max()) / side, np.finfo(np.float64).tiny)
            low = least - _WIDER * cell
            rows, columns = (np.floor((most - low) / cell).astype(np.int64) + 1).tolist()
            starts = np.zeros(rows * columns + 1, np.int32)
            _span(turned, mesh.faces, from_outside, low, cell, columns, starts, spans)
            # Slivers across the whole of it would be listed nearly everywhere.
            if along is not None or side == 1 or starts.sum() <= _MOST * count:
                break
            side //= 2
        starts = np.cumsum(starts, dtype=np.int32)
        highest, listed, tops = (
            np.full(rows * columns, -np.inf),
            np.empty(starts[-1], np.int32),
            np.empty(starts[-1]),
        )
        _list(turned, mesh.faces, spans, columns, starts, listed, tops, highest)
        return cls(turn, low, cell, starts, highest, listed, tops, turned, mesh.faces, columns, from_outside)

    @property
    def lists(self) -> Lists:
        """As the compiled loops take them."""
        return (
            *(self.turn, self.low, self.cell, self.columns, self.starts, self.most, self.listed, self.tops),
            *(self.turned, self.faces),
        )

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
        _sees(places, least, own, faced, self.from_outside, self.lists, seen)


def _across(lamp: FloatArray) -> FloatArray:
    """``(3, 3)`` rotation whose last column is a unit vector."""
    aside = np.zeros(3)
    aside[np.argmin(np.abs(lamp))] = 1.0
    one = np.cross(lamp, aside)
    one /= np.linalg.norm(one)
    return np.ascontiguousarray(np.column_stack([one, np.cross(lamp, one), lamp]))


@compiled
def _reach(turned: FloatArray) -> tuple[FloatArray, FloatArray]:
    """``(2,)`` least and greatest places across the light."""
    least, most = np.full(2, np.inf), np.full(2, -np.inf)
    for n in range(len(turned)):
        for axis in range(2):
            least[axis], most[axis] = min(least[axis], turned[n, axis]), max(most[axis], turned[n, axis])
    return least, most


@compiled
def _span(
    turned: FloatArray,
    faces: IntArray,
    from_outside: bool,
    low: FloatArray,
    cell: float,
    columns: int,
    counts: AnyArray,
    spans: AnyArray,
) -> None:
    """Which cells faces touch.

    Args:
        turned: of ``LampGrid``.
        faces: of the mesh.
        from_outside: whether faces that look towards the lamp touch none.
        low: of the grid.
        cell: of the grid.
        columns: of the grid.
        counts: ``(rows * columns + 1,)`` raised by the faces of each cell, from its second on.
        spans: ``(m, 4)`` int32, written: first row and the one after the last, and so of columns.
    """
    share, rows = 1.0 / cell, (len(counts) - 1) // columns
    for m in range(len(faces)):
        a, b, c = faces[m, 0], faces[m, 1], faces[m, 2]
        x0, x1, x2, y0, y1, y2 = (
            turned[a, 0],
            turned[b, 0],
            turned[c, 0],
            turned[a, 1],
            turned[b, 1],
            turned[c, 1],
        )
        spans[m, 0] = spans[m, 1] = 0
        if from_outside and (x1 - x0) * (y2 - y0) - (y1 - y0) * (x2 - x0) >= 0.0:
            continue
        i0, j0 = (min(x0, min(x1, x2)) - low[0]) * share, (min(y0, min(y1, y2)) - low[1]) * share
        i1, j1 = (max(x0, max(x1, x2)) - low[0]) * share, (max(y0, max(y1, y2)) - low[1]) * share
        spans[m, 0], spans[m, 1] = max(int(i0 - _WIDER), 0), min(int(i1 + _WIDER) + 1, rows)
        spans[m, 2], spans[m, 3] = max(int(j0 - _WIDER), 0), min(int(j1 + _WIDER) + 1, columns)
        for i in range(spans[m, 0], spans[m, 1]):
            for j in range(spans[m, 2], spans[m, 3]):
                counts[i * columns + j + 1] += 1


@compiled
def _list(
    turned: FloatArray,
    faces: IntArray,
    spans: AnyArray,
    columns: int,
    starts: AnyArray,
    listed: AnyArray,
    tops: FloatArray,
    most: FloatArray,
) -> None:
    """Fill in each cell's faces."""
    at = starts.copy()
    for m in range(len(faces)):
        if spans[m, 0] == spans[m, 1]:
            continue
        top = max(turned[faces[m, 0], 2], max(turned[faces[m, 1], 2], turned[faces[m, 2], 2]))
        for i in range(spans[m, 0], spans[m, 1]):
            for j in range(spans[m, 2], spans[m, 3]):
                n = at[i * columns + j]
                listed[n], tops[n] = m, top
                at[i * columns + j], most[i * columns + j] = n + 1, max(most[i * columns + j], top)


@compiled
def _sees(
    places: FloatArray,
    least: float,
    own: IntArray,
    faced: FloatArray,
    from_outside: bool,
    lists: Lists,
    seen: BoolArray,
) -> None:
    """See ``LampGrid.sees``."""
    turn, low, cell, columns, starts, most, listed, tops, turned, faces = lists
    rows, share = len(most) // columns, 1.0 / cell
    for n in range(len(places)):
        seen[n] = own[n] >= 0 and faced[n] > 0.0
        if not seen[n]:
            continue
        a, b, c = places[n, 0], places[n, 1], places[n, 2]
        x = a * turn[0, 0] + b * turn[1, 0] + c * turn[2, 0]
        y = a * turn[0, 1] + b * turn[1, 1] + c * turn[2, 1]
        above = a * turn[0, 2] + b * turn[1, 2] + c * turn[2, 2] + least
        i, j = int(np.floor((x - low[0]) * share)), int(np.floor((y - low[1]) * share))
        if not (0 <= i < rows and 0 <= j < columns) or above >= most[i * columns + j]:
            continue
        without = -1 if from_outside else own[n]
        for k in range(starts[i * columns + j], starts[i * columns + j + 1]):
            if tops[k] > above and listed[k] != without and _stops(turned, faces, listed[k], x, y, above):
                seen[n] = False
                break


@compiled
def _stops(turned: FloatArray, faces: IntArray, m: int, x: float, y: float, above: float) -> bool:
    """Whether a face covers a place across the light, higher than ``above``."""
    p, q, r = faces[m, 0], faces[m, 1], faces[m, 2]
    ax, ay = turned[q, 0] - turned[p, 0], turned[q, 1] - turned[p, 1]
    bx, by = turned[r, 0] - turned[p, 0], turned[r, 1] - turned[p, 1]
    area = ax * by - ay * bx
    if area == 0.0:
        return False
    sx, sy = x - turned[p, 0], y - turned[p, 1]
    u, v = (sx * by - sy * bx) / area, (ax * sy - ay * sx) / area
    # Written so that a NaN of a face seen edge-on stops nothing.
    if not (u >= -_ON_EDGE and v >= -_ON_EDGE and u + v <= 1.0 + _ON_EDGE):
        return False
    z = turned[p, 2]
    return bool(z + u * (turned[q, 2] - z) + v * (turned[r, 2] - z) > above)
