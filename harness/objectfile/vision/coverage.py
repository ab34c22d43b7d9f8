"""Which pixels a mesh covers and how much of each, and which face is in front, how deep.

Seen from one place the faces that are turned towards it, each gone around, leave only the edges where they
meet a face that is turned away or nothing: along all others two of them go opposite ways. Around a place of
the picture these edges go as often as faces cover it, so that what is covered is known from the few edges of
the outline, without any face. Which face is in front is then found at one place of every pixel; inverse depth
is linear in the picture, so that a triangle is a plane there.
"""

from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray, IntArray, read_only
from harness.basics.compiled import compiled
from harness.basics.mesh import Mesh, signed_volume
from harness.picture.pinhole import Pinhole

NEAREST = 1e-6
"""m before the camera: what is nearer is not seen."""


@dataclass(frozen=True, eq=False)
class Outline:
    """A picture's pixels, those that show anything."""

    pixels: AnyArray  #: ``(n,)`` counted row by row.
    cover: AnyArray  #: ``(n,)`` float32: share of each that is covered.
    places: AnyArray  #: ``(n, 2)`` float32 x and y, pixels: the covered place that is nearest to its centre.
    depth: AnyArray  #: ``(n,)`` float32 m, there.
    faces: AnyArray  #: ``(n,)`` int32, which face is in front there.


@cache
def centre_out(side: int) -> AnyArray:
    """``(side * side, 2)`` int64 sub-pixels of a pixel, row and column, from its centre outwards."""
    rows, columns = np.divmod(np.arange(side * side), side)
    away = (rows - side // 2) ** 2 + (columns - side // 2) ** 2
    chosen = np.argsort(away, kind="stable")
    return read_only(np.stack([rows[chosen], columns[chosen]], axis=1))


def is_closed(mesh: Mesh) -> bool:
    """Whether a surface has no border, and its faces look outwards: some face then hides each one's back."""
    begin, end = mesh.faces.reshape(-1), np.roll(mesh.faces, -1, axis=1).reshape(-1)
    # One number for a way along an edge: rows would be sorted ten times as slowly.
    forth, back = (np.sort(one * len(mesh.vertices) + other) for one, other in ((begin, end), (end, begin)))
    matched = np.array_equal(forth, back) and bool((np.diff(forth) > 0).all())
    return matched and signed_volume(mesh) > 0.0


def mesh_outline(contours: "Contours", camera: Pinhole, side: int) -> Outline:
    """Find what a mesh covers of a picture.

    Args:
        contours: of the mesh.
        camera: that looks; the mesh may reach behind it.
        side: sub-pixels along a pixel, odd.
    """
    low, high = contours.mesh.bounds
    hides = contours.closed and bool(((camera.eye < low) | (camera.eye > high)).any())
    seen = np.empty((len(contours.mesh.vertices), 3))
    x, y = side * camera.centre_px[0] - 0.5, side * camera.centre_px[1] - 0.5
    pose, focal, owners = camera.camera_from_object, side * camera.focal_px, None
    if not projected(contours.mesh.vertices, pose, focal, x, y, seen) >= NEAREST:
        cut, owners = _in_front(contours.mesh, camera)
        contours, seen = Contours.of(cut), np.empty((len(cut.vertices), 3))
        projected(cut.vertices, pose, focal, x, y, seen)
    rows, columns, offsets = camera.height, camera.width, centre_out(side)
    sides, shown = contours.turned(camera.eye, hides)
    count, looked = np.empty((rows, columns), np.uint8), np.empty((rows, columns), np.uint8)
    begins, stretches = crossed(seen, contours.edges, sides, rows * side, columns * side)
    most = covered(begins, stretches, side, offsets, count, looked)
    nearness, front = np.zeros((rows, columns), np.float32), np.empty((rows, columns), np.int32)
    find_front(seen, contours.faces, shown, looked, offsets, side, nearness, front)
    found = Outline(*gathered(count, looked, nearness, front, side, offsets, most))
    return found if owners is None else replace(found, faces=owners[found.faces])


def _in_front(mesh: Mesh, camera: Pinhole) -> tuple[Mesh, AnyArray]:
    """Cut a mesh ``NEAREST`` before the camera; also ``(m,)`` int32, the face that each face is a part of."""
    towards = camera.camera_from_object[2]
    depth = mesh.vertices @ towards[:3] + towards[3]
    ahead = depth >= NEAREST
    count = ahead[mesh.faces].sum(axis=1)
    vertices, cuts = list(mesh.vertices), dict[tuple[int, int], int]()
    faces, owners = mesh.faces[count == 3].tolist(), np.flatnonzero(count == 3).tolist()
    for face in np.flatnonzero((count > 0) & (count < 3)).tolist():
        polygon: list[int] = []
        corners = mesh.faces[face].tolist()
        for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
            if ahead[a]:
                polygon.append(a)
            if ahead[a] != ahead[b]:
                low, high = min(a, b), max(a, b)
                if (low, high) not in cuts:
                    share = (NEAREST - depth[low]) / (depth[high] - depth[low])
                    cuts[low, high] = len(vertices)
                    vertices.append(vertices[low] + share * (vertices[high] - vertices[low]))
                polygon.append(cuts[low, high])
        faces += [[polygon[0], *pair] for pair in pairwise(polygon[1:])]
        owners += [face] * (len(polygon) - 2)
    cut = Mesh(np.array(vertices), np.array(faces, np.int64).reshape(-1, 3))
    return cut, np.array(owners, np.int32)


EMPTY = 255
"""In place of a sub-pixel: none is covered."""


@dataclass(frozen=True, eq=False)
class Contours:
    """Of a mesh: its faces' planes, and which faces meet along its edges."""

    mesh: Mesh  #: in metres.
    closed: bool  #: whether it is, of ``is_closed``.
    faces: AnyArray  #: ``(m, 3)`` uint32, the mesh's.
    planes: FloatArray
    """``(4, faces)``: normal of any length, outward, and its product with the face's places."""
    edges: AnyArray
    """``(e, 4)`` int32: two vertices, the face that goes from the first to the second, and one that goes
    back, or -1."""

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
        return cls(mesh, is_closed(mesh), *made)

    def turned(self, eye: FloatArray, hides: bool) -> tuple[AnyArray, AnyArray]:
        """Find which faces are turned towards an eye.

        Args:
            eye: ``(3,)`` m.
            hides: whether faces seen from behind are hidden by others.

        Returns:
            ``(faces,)`` int8, 1 of faces turned towards the eye, else -1, or 0 where they are hidden; and
            ``(k,)`` int32, which are not hidden, in their order.
        """
        sides, some = np.empty(len(self.faces), np.int8), np.empty(len(self.faces), np.int32)
        shown = _turned(self.planes, eye[0], eye[1], eye[2], 0 if hides else -1, sides, some)
        return sides, some[:shown]


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


_ON_EDGE = 1e-7
"""Pixels by which a triangle is widened, so that no place falls between two that share an edge."""


@compiled
def projected(
    vertices: FloatArray, camera_from_object: FloatArray, focal: float, x: float, y: float, seen: FloatArray
) -> float:
    """Vertices as places in the picture with inverse depth; the least depth of all, m, is returned.

    Args:
        vertices: ``(n, 3)`` m, object frame.
        camera_from_object: ``(4, 4)``.
        focal: in any unit, which is that of places then.
        x: of the axis.
        y: of the axis.
        seen: ``(n, 3)`` x, y and 1/m, written; without meaning where depth is not positive.
    """
    m, least = camera_from_object, np.inf
    for n in range(len(vertices)):
        a, b, c = vertices[n, 0], vertices[n, 1], vertices[n, 2]
        depth = m[2, 0] * a + m[2, 1] * b + m[2, 2] * c + m[2, 3]
        near = 1.0 / depth if depth != 0.0 else 0.0
        seen[n, 0] = focal * near * (m[0, 0] * a + m[0, 1] * b + m[0, 2] * c + m[0, 3]) + x
        seen[n, 1] = focal * near * (m[1, 0] * a + m[1, 1] * b + m[1, 2] * c + m[1, 3]) + y
        seen[n, 2] = near
        least = min(least, depth)
    return least


@compiled
def find_front(
    seen: FloatArray,
    faces: AnyArray,
    some: AnyArray,
    places: AnyArray,
    offsets: AnyArray,
    side: int,
    nearness: AnyArray,
    front: AnyArray,
) -> None:
    """The greatest inverse depth of some faces at the chosen places of pixels, and whose it is.

    Args:
        seen: ``(n, 3)`` x and y of vertices in sub-pixels, whose centres are whole numbers, and 1/m.
        faces: ``(m, 3)`` uint32.
        some: ``(k,)`` int32, of the faces; the first of any that are equally near is taken.
        places: ``(rows, columns)`` which of ``offsets`` is looked at; ``EMPTY`` for none.
        offsets: ``(k, 2)`` row and column of sub-pixels in a pixel.
        side: sub-pixels along a pixel.
        nearness: ``(rows, columns)`` float32 1/m, raised; 0 where there is nothing.
        front: ``(rows, columns)`` int32, written.
    """
    rows, columns = places.shape
    scale = float(side)
    for n in range(len(some)):
        m = some[n]
        a, b, c = faces[m, 0], faces[m, 1], faces[m, 2]
        x0, x1, x2, y0, y1, y2 = seen[a, 0], seen[b, 0], seen[c, 0], seen[a, 1], seen[b, 1], seen[c, 1]
        i0, i1 = _pixels(min(y0, min(y1, y2)), max(y0, max(y1, y2)), scale, rows)
        j0, j1 = _pixels(min(x0, min(x1, x2)), max(x0, max(x1, x2)), scale, columns)
        if i0 > i1 or j0 > j1:
            continue
        ax, ay, bx, by = x1 - x0, y1 - y0, x2 - x0, y2 - y0
        area = ax * by - bx * ay
        if area == 0.0:
            continue
        one = 1.0 / area
        ux, uy, vx, vy = by * one, -bx * one, -ay * one, ax * one
        z0, z1, z2 = seen[a, 2], seen[b, 2], seen[c, 2]
        az, bz, most = z1 - z0, z2 - z0, max(z0, max(z1, z2))
        wider = _ON_EDGE * max(abs(ux) + abs(uy), abs(vx) + abs(vy))
        for i in range(i0, i1 + 1):
            for j in range(j0, j1 + 1):
                at = places[i, j]
                if at == EMPTY:
                    continue
                dy, dx = i * scale + offsets[at, 0] - y0, j * scale + offsets[at, 1] - x0
                u, v = ux * dx + uy * dy, vx * dx + vy * dy
                if u >= -wider and v >= -wider and u + v <= 1.0 + 2.0 * wider:
                    value = np.float32(min(z0 + u * az + v * bz, most))
                    if value > nearness[i, j]:
                        nearness[i, j], front[i, j] = value, m


@compiled
def _pixels(low: float, high: float, scale: float, count: int) -> tuple[int, int]:
    """First and last of so many pixels that have a sub-pixel from ``low`` to ``high``."""
    begin = np.ceil(max(low, 0.0) - _ON_EDGE)
    end = np.floor(min(high, count * scale - 1.0) + _ON_EDGE)
    if begin > end:
        return 0, -1
    return int((begin + 0.5) / scale), int((end + 0.5) / scale)


@compiled
def gathered(
    count: AnyArray,
    places: AnyArray,
    nearness: AnyArray,
    front: AnyArray,
    side: int,
    offsets: AnyArray,
    most: int,
) -> tuple[AnyArray, AnyArray, AnyArray, AnyArray, AnyArray]:
    """Pixels that show anything, as an ``Outline`` has them; what rounding left to no face is left out.

    Args:
        count: ``(rows, columns)`` covered sub-pixels of each pixel.
        places: of ``find_front``, and so are the next three.
        nearness: 1/m.
        front: faces.
        side: sub-pixels along a pixel.
        offsets: of places.
        most: pixels that are covered.
    """
    pixels, cover = np.empty(most, np.int64), np.empty(most, np.float32)
    middles, depth, faces = (
        np.empty((most, 2), np.float32),
        np.empty(most, np.float32),
        np.empty(most, np.int32),
    )
    n, columns = 0, count.shape[1]
    for i in range(count.shape[0]):
        for j in range(columns):
            if places[i, j] == EMPTY or not nearness[i, j] > np.float32(0.0):
                continue
            row, column = offsets[places[i, j], 0], offsets[places[i, j], 1]
            pixels[n], cover[n] = i * columns + j, count[i, j] / (side * side)
            middles[n, 0] = j + 0.5 + (column - side // 2) / side
            middles[n, 1] = i + 0.5 + (row - side // 2) / side
            depth[n], faces[n] = np.float32(1.0) / nearness[i, j], front[i, j]
            n += 1
    return pixels[:n], cover[:n], middles[:n], depth[:n], faces[:n]
