"""Where a mesh's outline crosses the rows of a picture, and what it covers of each pixel.

Seen from one place the faces that are turned towards it, each gone around, leave only the edges where they
meet a face that is turned away or nothing: along all others two of them go opposite ways. Around a place of
the picture these edges go as often as faces cover it, so that what is covered is known from the few edges of
the outline, without any face.
"""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray, IntArray, read_only
from harness.basics.compiled import compiled
from harness.basics.mesh import Mesh

EMPTY = 255
"""In place of a sub-pixel: none is covered."""


@dataclass(frozen=True, eq=False)
class Contours:
    """Of a mesh: its faces' planes, and which faces meet along its edges.

    Attributes:
        bounds: ``(2, 3)`` m, of the mesh.
        faces: ``(m, 3)`` uint32, the mesh's.
        planes: ``(4, faces)``: normal of any length, outward, and its product with the face's places.
        edges: ``(e, 4)`` int32: two vertices, the face that goes from the first to the second, and one that
            goes back, or -1.
    """

    bounds: FloatArray
    faces: AnyArray
    planes: FloatArray
    edges: AnyArray

    @classmethod
    def of(cls, mesh: Mesh) -> "Contours":
        """Any mesh; with edges of one face, or of three, too."""
        first, second, third = (mesh.corners[:, c] for c in range(3))
        normals = np.cross(second - first, third - first)
        away = np.einsum("nx,nx->n", normals, first)
        planes = np.ascontiguousarray(np.column_stack([normals, away]).T)
        made = (mesh.faces.astype(np.uint32), planes, _paired(mesh.faces))
        for each in made:
            read_only(each)
        return cls(mesh.bounds, *made)

    def turned(self, eye: FloatArray, closed: bool, sides: AnyArray, some: AnyArray) -> int:
        """Fill in ``(faces,)`` int8: 1 of faces turned towards an eye, else -1; or 0 where they are hidden.

        Args:
            eye: ``(3,)`` m.
            closed: whether faces seen from behind are hidden by others.
            sides: written.
            some: ``(faces,)`` int32, which are not hidden, in their order; written.

        Returns:
            How many are not hidden.
        """
        return int(_turned(self.planes, eye[0], eye[1], eye[2], 0 if closed else -1, sides, some))


def _paired(faces: IntArray) -> AnyArray:
    """``edges`` of ``Contours``."""
    begin, end = faces.reshape(-1), np.roll(faces, -1, axis=1).reshape(-1)
    owner = np.repeat(np.arange(len(faces)), 3)
    key = np.minimum(begin, end) * (int(faces.max(initial=0)) + 1) + np.maximum(begin, end)
    most = 1 + int(np.unique(key, return_counts=True)[1].max(initial=0))
    # Where more than one goes the same way, the first goes with the first that comes back.
    up, up_name = _named(key, np.flatnonzero(begin < end), most)
    down, down_name = _named(key, np.flatnonzero(begin > end), most)
    _, at, to = np.intersect1d(up_name, down_name, assume_unique=True, return_indices=True)
    partner, alone = np.full(len(begin), -1), np.ones(len(down), np.bool_)
    partner[up[at]], alone[to] = owner[down[to]], False
    chosen = np.sort(np.concatenate([up, down[alone]]))
    edges = np.column_stack([begin[chosen], end[chosen], owner[chosen], partner[chosen]])
    return np.ascontiguousarray(edges.astype(np.int32))


def _named(key: IntArray, some: IntArray, most: int) -> tuple[IntArray, IntArray]:
    """Sides of faces ordered by key, and a name of each: its key, and how many before it have the same."""
    order = some[np.argsort(key[some], kind="stable")]
    held = key[order]
    return order, held * most + np.arange(len(held)) - np.searchsorted(held, held)


@compiled
def _turned(
    planes: FloatArray, x: float, y: float, z: float, hidden: int, sides: AnyArray, some: AnyArray
) -> int:
    """See ``Contours.turned``."""
    count = 0
    for m in range(planes.shape[1]):
        above = planes[0, m] * x + planes[1, m] * y + planes[2, m] * z - planes[3, m]
        sides[m] = 1 if above > 0.0 else hidden
    for m in range(planes.shape[1]):
        # Written first and counted after: a branch would be guessed wrong along every outline.
        some[count] = m
        count += 1 if sides[m] != 0 else 0
    return count


@compiled
def crossed(
    seen: FloatArray, edges: AnyArray, sides: AnyArray, rows: int, columns: int
) -> tuple[AnyArray, AnyArray]:
    """Stretches of each row of sub-pixels that a mesh covers.

    A place counts to what begins on it and not to what ends on it; every edge is looked at once, so that
    faces beside each other leave nothing out and count nothing twice.

    Args:
        seen: ``(n, 3)`` x and y of vertices in sub-pixels, whose centres are whole numbers; all in front.
        edges: of ``Contours``.
        sides: of ``Contours.turned``.
        rows: of sub-pixels.
        columns: of sub-pixels.

    Returns:
        ``(rows + 1,)`` where each row's begin, and ``(m, 2)`` int32 stretches in order: from which column to
        before which.
    """
    starts, few = np.zeros(rows + 2, np.int64), np.empty(len(edges), np.int32)
    count = 0
    for e in range(len(edges)):
        other = edges[e, 3]
        if sides[edges[e, 2]] != (sides[other] if other >= 0 else 0):
            few[count] = e
            count += 1
    for k in range(count):
        first, last = _rows_of(seen[edges[few[k], 0], 1], seen[edges[few[k], 1], 1], rows)
        for i in range(first, last):
            starts[i + 2] += 1
    for i in range(2, rows + 2):
        starts[i] += starts[i - 1]
    met = np.empty(starts[rows + 1], np.int64)
    for k in range(count):
        a, b = edges[few[k], 0], edges[few[k], 1]
        other = edges[few[k], 3]
        times = int(sides[edges[few[k], 2]]) - (int(sides[other]) if other >= 0 else 0)
        first, last = _rows_of(seen[a, 1], seen[b, 1], rows)
        if first >= last:
            continue
        slope = (seen[b, 0] - seen[a, 0]) / (seen[b, 1] - seen[a, 1])
        times = times if seen[b, 1] > seen[a, 1] else -times
        for i in range(first, last):
            place = seen[a, 0] + (i - seen[a, 1]) * slope
            column = int(np.ceil(min(max(place, 0.0), columns)))
            met[starts[i + 1]] = 8 * column + times + 4
            starts[i + 1] += 1
    return _stretches(met, starts[: rows + 1])


@compiled
def _rows_of(one: float, other: float, rows: int) -> tuple[int, int]:
    """First row that is not before an edge, and first that is not before its end."""
    low, high = min(one, other), max(one, other)
    return int(np.ceil(min(max(low, 0.0), rows))), int(np.ceil(min(max(high, 0.0), rows)))


@compiled
def _stretches(met: AnyArray, starts: AnyArray) -> tuple[AnyArray, AnyArray]:
    """What is covered between crossings, row by row; see ``crossed``.

    Args:
        met: ``(n,)`` eight times the column, plus four and how often a face's inside begins there.
        starts: ``(rows + 1,)`` where each row's begin.
    """
    begins, found, count = np.empty(len(starts), np.int64), np.empty((len(met) // 2 + 1, 2), np.int32), 0
    for i in range(len(starts) - 1):
        begins[i] = count
        row = met[starts[i] : starts[i + 1]]
        row.sort()
        around, begun = 0, 0
        for k in range(len(row)):
            before, around = around, around + (row[k] & 7) - 4
            if before == 0 and around != 0:
                begun = row[k] >> 3
            if around == 0 and before != 0 and row[k] >> 3 > begun:
                found[count, 0], found[count, 1] = begun, row[k] >> 3
                count += 1
    begins[len(starts) - 1] = count
    return begins, found[:count]


@compiled
def covered(
    begins: AnyArray,
    stretches: AnyArray,
    side: int,
    offsets: AnyArray,
    count: AnyArray,
    places: AnyArray,
) -> int:
    """How many sub-pixels of each pixel are covered, and which of these is nearest to its centre.

    Args:
        begins: of ``crossed``, and so are ``stretches``.
        stretches: of rows of sub-pixels.
        side: sub-pixels along a pixel.
        offsets: ``(side * side, 2)`` row and column of each, from the centre outwards.
        count: ``(rows, columns)`` uint8, written.
        places: ``(rows, columns)`` uint8, written: which of ``offsets``, or ``EMPTY``.

    Returns:
        Pixels that are covered anywhere.
    """
    rows, columns = count.shape
    more, some = np.empty(columns + 1, np.int32), 0
    for i in range(rows):
        more[:] = 0
        single = np.zeros(columns + 1, np.int32)
        for k in range(begins[i * side], begins[(i + 1) * side]):
            first, last = stretches[k, 0], stretches[k, 1]
            a, b = first // side, last // side
            single[a] -= first - a * side
            single[b] += last - b * side
            more[a] += side
            more[b] -= side
        sum_ = 0
        for j in range(columns):
            sum_ += more[j]
            whole = sum_ + single[j]
            count[i, j] = whole
            some += 1 if whole > 0 else 0
            places[i, j] = EMPTY if whole == 0 else 0
            if 0 < whole < side * side:
                places[i, j] = _nearest(begins, stretches, side, offsets, i, j)
    return some


@compiled
def _nearest(begins: AnyArray, stretches: AnyArray, side: int, offsets: AnyArray, i: int, j: int) -> int:
    """The covered sub-pixel that is nearest to a pixel's centre."""
    for at in range(len(offsets)):
        row, column = i * side + offsets[at, 0], j * side + offsets[at, 1]
        for k in range(begins[row], begins[row + 1]):
            if stretches[k, 0] <= column < stretches[k, 1]:
                return at
    return EMPTY
