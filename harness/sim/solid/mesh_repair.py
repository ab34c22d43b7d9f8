"""Steps that turn a soup of triangles into a surface one can touch; each says what it did."""

from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, connected_components
from scipy.spatial import cKDTree

from harness.basics.arrays import BoolArray, FloatArray, IntArray
from harness.basics.faces.mesh_rays import is_inside, openness

_WELD = 2e-6
_SPECK_SIZE, _SPECK_AREA = 0.03, 0.002
_FLAT = 1e-12
_MOST_PATCHES = 256
_FEW = 0.05


@dataclass
class RepairedSurface:
    """Triangles under repair, and the list of what was done to them."""

    vertices: FloatArray
    faces: IntArray
    repairs: list[str] = field(default_factory=list)

    def keep(self, faces: BoolArray | IntArray) -> None:
        """Drop all faces but these, and the vertices no face uses."""
        used, inverse = np.unique(self.faces[faces], return_inverse=True)
        self.vertices = self.vertices[used]
        self.faces = inverse.reshape(-1, 3)

    @property
    def corners(self) -> FloatArray:
        """``(m, 3, 3)``."""
        return self.vertices[self.faces]

    @property
    def size(self) -> float:
        """The longest side of the box around it."""
        return float(np.ptp(self.vertices, axis=0).max()) if len(self.vertices) else 0.0

    def areas(self) -> FloatArray:
        """``(m,)``."""
        a, b, c = self.corners[:, 0], self.corners[:, 1], self.corners[:, 2]
        areas: FloatArray = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
        return areas


def weld(surface: RepairedSurface) -> None:
    """Make one vertex of those closer than two millionths of the size: textures and STL split them."""
    places, index = np.unique(surface.vertices, axis=0, return_inverse=True)
    # One stray vertex must not decide what "close" means for all the others.
    usual = float(np.ptp(np.percentile(places, [5.0, 95.0], axis=0), axis=0).max())
    pairs = cKDTree(places).query_pairs(_WELD * usual, output_type="ndarray")
    label = connected_components(_graph(pairs, len(places)), directed=False)[1]
    first = np.unique(label, return_index=True)[1]
    before = len(surface.vertices)
    surface.vertices, surface.faces = places[first], label[index.ravel()][surface.faces].astype(np.int64)
    if len(first) < before:
        surface.repairs.append(f"welded {before} vertices into {len(first)}")


def drop_collapsed(surface: RepairedSurface) -> None:
    """Drop faces that name a vertex twice."""
    f = surface.faces
    sound = (f[:, 0] != f[:, 1]) & (f[:, 1] != f[:, 2]) & (f[:, 2] != f[:, 0])
    _drop(surface, sound, "collapsed faces")


def drop_flat(surface: RepairedSurface) -> None:
    """Drop faces whose corners lie on one line; the slit they leave has no width."""
    _drop(surface, surface.areas() > _FLAT * surface.size**2, "faces without area")


def drop_duplicates(surface: RepairedSurface) -> None:
    """Keep one face of those with the same three corners.

    A few pairs that face against each other are flaps that welding has pressed flat, or a face in which two
    solids meet: both go, and so do more of them if what is left is closed. Where most faces have such a twin
    the file holds a sheet drawn from both sides: one stays.
    """
    groups, first, inverse = np.unique(
        np.sort(surface.faces, axis=1), axis=0, return_index=True, return_inverse=True
    )
    once = np.zeros(len(surface.faces), dtype=np.bool_)
    once[first] = True
    balance = np.bincount(inverse.ravel(), _parity(surface.faces), minlength=len(groups))
    count = np.bincount(inverse.ravel(), minlength=len(groups))
    flap = (count > 1) & (balance == 0)
    without = once.copy()
    without[first[flap]] = False
    if flap.sum() < _FEW * len(groups) or (without.any() and _is_closed(surface.faces[without])):
        once = without
    _drop(surface, once, "duplicate faces")


def _parity(faces: IntArray) -> FloatArray:
    """+1 for a face whose corners are a rotation of their sorted order, -1 for its mirror image."""
    rolled = np.take_along_axis(faces, (np.argmin(faces, axis=1)[:, None] + np.arange(3)) % 3, axis=1)
    return np.where(rolled[:, 1] < rolled[:, 2], 1.0, -1.0)


def drop_specks(surface: RepairedSurface) -> None:
    """Drop separate crumbs: small, nearly without area, and not the most of the surface."""
    body = bodies(surface)
    area = np.bincount(body, surface.areas())
    small = np.array([_extent(surface, body == k) for k in range(len(area))]) < _SPECK_SIZE * surface.size
    speck = small & (area < _SPECK_AREA * area.sum())
    if speck.any() and area[speck].sum() < 0.02 * area.sum():
        surface.keep(~speck[body])
        surface.repairs.append(f"removed {int(speck.sum())} floating specks")


def bodies(surface: RepairedSurface) -> IntArray:
    """``(m,)`` which connected body each face belongs to."""
    f = surface.faces
    graph = _graph(np.vstack([f[:, :2], f[:, 1:]]), len(surface.vertices))
    label = connected_components(graph, directed=False)[1]
    renumbered: IntArray = np.unique(label[f[:, 0]], return_inverse=True)[1].astype(np.int64)
    return renumbered


def orient(surface: RepairedSurface) -> None:
    """Make neighbours agree, then turn every patch to face the room.

    A closed patch faces outward if its volume is positive, unless an odd number of other
    closed patches surround it: then it is the wall of a cavity. An open patch faces the side
    from which more of the room is seen.
    """
    patch, flipped = _consistent(surface)
    surface.faces[flipped] = surface.faces[flipped][:, ::-1]
    turned = int(flipped.sum())
    count = int(patch.max()) + 1
    if count > _MOST_PATCHES:
        surface.repairs.append(f"left {count} loose patches facing as they do: too many to judge")
        return
    closed = [_is_closed(surface.faces[patch == k]) for k in range(count)]
    inverted = 0
    for k in range(count):
        mine = patch == k
        others = [patch == j for j in range(count) if closed[j] and j != k]
        if not _faces_room(surface, mine, closed[k], others):
            surface.faces[mine] = surface.faces[mine][:, ::-1]
            inverted += 1
    if turned > 0:
        surface.repairs.append(f"turned {min(turned, len(surface.faces) - turned)} faces to agree")
    if inverted:
        surface.repairs.append(f"turned {inverted} of {count} patches outward")


def boundary_edges(faces: IntArray) -> IntArray:
    """``(n, 2)`` directed edges that only one face uses."""
    directed = np.vstack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    _, first, count = np.unique(np.sort(directed, axis=1), axis=0, return_index=True, return_counts=True)
    lonely: IntArray = directed[first[count == 1]]
    return lonely


def is_watertight(faces: IntArray) -> bool:
    """Whether every edge joins two faces that agree on the outside."""
    directed = np.vstack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    once = len(np.unique(directed, axis=0)) == len(directed)
    return once and len(boundary_edges(faces)) == 0


def _drop(surface: RepairedSurface, sound: BoolArray, what: str) -> None:
    dropped = int(np.count_nonzero(~sound))
    if dropped:
        surface.keep(sound)
        surface.repairs.append(f"dropped {dropped} {what}")


def _graph(pairs: IntArray, size: int) -> coo_array:
    return coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(size, size))


def _extent(surface: RepairedSurface, faces: BoolArray) -> float:
    return float(np.ptp(surface.corners[faces].reshape(-1, 3), axis=0).max())


def _is_closed(faces: IntArray) -> bool:
    return len(boundary_edges(faces)) == 0


def _consistent(surface: RepairedSurface) -> tuple[IntArray, BoolArray]:
    """Patches joined over edges of exactly two faces, and the faces to flip so that they agree."""
    f = surface.faces
    count = len(f)
    directed = np.vstack([f[:, [0, 1]], f[:, [1, 2]], f[:, [2, 0]]])
    owner = np.tile(np.arange(count), 3)
    low, high = directed.min(axis=1), directed.max(axis=1)
    order = np.lexsort((high, low))
    starts = np.flatnonzero(np.r_[True, (np.diff(low[order]) != 0) | (np.diff(high[order]) != 0)])
    two = starts[np.diff(np.r_[starts, len(order)]) == 2]
    one, other = order[two], order[two + 1]
    same_way = directed[one, 0] == directed[other, 0]
    pairs = np.column_stack([owner[one], owner[other]])
    disagree = {(int(a), int(b)): bool(s) for (a, b), s in zip(pairs, same_way, strict=True) if s}
    graph = _graph(pairs, count).tocsr()
    patch = connected_components(graph, directed=False)[1].astype(np.int64)
    flipped = np.zeros(count, dtype=np.bool_)
    if disagree:
        for root in np.unique(patch, return_index=True)[1]:
            reached, parent = breadth_first_order(graph, root, directed=False)
            for face in reached[1:]:
                above = int(parent[face])
                differs = disagree.get((above, int(face)), False) or disagree.get((int(face), above), False)
                flipped[face] = flipped[above] ^ differs
    return patch, flipped


def _faces_room(surface: RepairedSurface, mine: BoolArray, closed: bool, others: list[BoolArray]) -> bool:
    corners = surface.corners
    if not closed:
        return openness(np.flatnonzero(mine), corners) >= 0.0
    own = corners[mine]
    # Far from the origin the terms of the sum cancel: spokes from a corner of the patch do not.
    spokes = own - own[0, 0]
    volume = float(np.einsum("ij,ij->i", spokes[:, 0], np.cross(spokes[:, 1], spokes[:, 2])).sum())
    around = sum(_surrounds(corners[other], own) for other in others)
    return (volume > 0.0) == (around % 2 == 0)


def _surrounds(outer: FloatArray, inner: FloatArray) -> int:
    """1 if a closed surface holds the whole of another, by its box and eight of its corners."""
    low, high = outer.min(axis=(0, 1)), outer.max(axis=(0, 1))
    if (inner.min(axis=(0, 1)) < low).any() or (inner.max(axis=(0, 1)) > high).any():
        return 0
    some = inner[:: max(1, len(inner) // 8), 0]
    return int(is_inside(np.ascontiguousarray(some), np.ascontiguousarray(outer)).all())
