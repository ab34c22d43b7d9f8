"""Steps that turn a soup of triangles into a surface one can touch; each says what it did.

Solids that meet: at an edge or a point, each keeps a surface of its own; in a face, they are one.
"""

from dataclasses import dataclass, field

import numpy as np
from manifold3d import Error, Manifold
from manifold3d import Mesh as ManifoldMesh
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, connected_components
from scipy.spatial import cKDTree

from harness.basics.arrays import BoolArray, FloatArray, IntArray, row_keys
from harness.basics.faces.mesh_rays import is_inside, openness

_WELD = 2e-6
_SPECK_SIZE, _SPECK_AREA = 0.03, 0.002
_MOST_PATCHES = 256
_FEW = 0.05
_LARGEST_HOLE = 0.08

_SAME_ANGLE = 1e-6
"""rad between two faces about their edge that lie on each other."""


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


def drop_faces(surface: RepairedSurface, sound: BoolArray, what: str) -> None:
    """Keep the sound faces only; ``what`` names the others in the list of repairs."""
    dropped = int(np.count_nonzero(~sound))
    if dropped:
        surface.keep(sound)
        surface.repairs.append(f"dropped {dropped} {what}")


def drop_duplicates(surface: RepairedSurface) -> None:
    """Keep one face of those with the same three corners.

    A few pairs that face against each other are flaps that welding has pressed flat, or a face in which two
    solids meet: both go, and so do more of them if what is left is closed. Where most faces have such a twin
    the file holds a sheet drawn from both sides: one stays.
    """
    groups, first, inverse = np.unique(
        row_keys(np.sort(surface.faces, axis=1)), return_index=True, return_inverse=True
    )
    once = np.zeros(len(surface.faces), dtype=np.bool_)
    once[first] = True
    # Parity: +1 for a face whose corners are a rotation of their sorted order, -1 for its mirror image.
    start = np.argmin(surface.faces, axis=1)[:, None]
    rolled = np.take_along_axis(surface.faces, (start + np.arange(3)) % 3, axis=1)
    parity = np.where(rolled[:, 1] < rolled[:, 2], 1.0, -1.0)
    balance = np.bincount(inverse.ravel(), parity, minlength=len(groups))
    count = np.bincount(inverse.ravel(), minlength=len(groups))
    flap = (count > 1) & (balance == 0)
    without = once.copy()
    without[first[flap]] = False
    if flap.sum() < _FEW * len(groups) or (without.any() and _is_closed(surface.faces[without])):
        once = without
    drop_faces(surface, once, "duplicate faces")


def drop_specks(surface: RepairedSurface) -> None:
    """Drop separate crumbs: small, nearly without area, and not the most of the surface."""
    body = bodies(surface)
    area = np.bincount(body, surface.areas())
    corners = surface.corners
    extents = [float(np.ptp(corners[body == k].reshape(-1, 3), axis=0).max()) for k in range(len(area))]
    speck = (np.array(extents) < _SPECK_SIZE * surface.size) & (area < _SPECK_AREA * area.sum())
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
    _, first, count = np.unique(row_keys(np.sort(directed, axis=1)), return_index=True, return_counts=True)
    lonely: IntArray = directed[first[count == 1]]
    return lonely


def is_watertight(faces: IntArray) -> bool:
    """Whether every edge joins two faces that agree on the outside."""
    directed = np.vstack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    once = len(np.unique(row_keys(directed))) == len(directed)
    return once and len(boundary_edges(faces)) == 0


def _graph(pairs: IntArray, size: int) -> coo_array:
    return coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(size, size))


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
    disagree = {(int(a), int(b)) for a, b in pairs[same_way]}
    graph = _graph(pairs, count).tocsr()
    patch = connected_components(graph, directed=False)[1].astype(np.int64)
    flipped = np.zeros(count, dtype=np.bool_)
    if disagree:
        for root in np.unique(patch, return_index=True)[1]:
            reached, parent = breadth_first_order(graph, root, directed=False)
            for face in reached[1:]:
                above = int(parent[face])
                differs = (above, int(face)) in disagree or (int(face), above) in disagree
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


def fill_holes(surface: RepairedSurface) -> None:
    """Close holes whose box is under 8 % of the size with a fan about their middle.

    Larger ones are mouths of vessels as often as damage: they stay.
    """
    filled, slits = 0, 0
    # Closed walks along directed boundary edges; places where two rims touch are left alone.
    edges = boundary_edges(surface.faces)
    starts, times = np.unique(edges[:, 0], return_counts=True)
    following = {int(a): int(b) for a, b in edges}
    forked = set(starts[times > 1].tolist())
    loops = []
    while following:
        walk = [next(iter(following))]
        while (step := following.pop(walk[-1], None)) is not None and step != walk[0]:
            walk.append(step)
        if step == walk[0] and len(walk) >= 3 and not forked.intersection(walk):
            loops.append(np.array(walk, dtype=np.int64))
    for loop in loops:
        rim = surface.vertices[loop]
        if float(np.ptp(rim, axis=0).max()) > _LARGEST_HOLE * surface.size:
            continue
        middle = rim.mean(axis=0)
        spokes = rim - middle
        fan_area = 0.5 * np.linalg.norm(np.cross(spokes, np.roll(rim, -1, axis=0) - middle), axis=1).sum()
        if fan_area < 1e-3 * float(np.ptp(rim, axis=0).max()) ** 2:
            slits += 1
            continue
        hub = len(surface.vertices)
        surface.vertices = np.vstack([surface.vertices, rim.mean(axis=0)])
        # The new faces run along the rim against its own faces.
        fan = np.column_stack([np.roll(loop, -1), loop, np.full(len(loop), hub)])
        surface.faces = np.vstack([surface.faces, fan])
        filled += 1
    if filled:
        surface.repairs.append(f"filled {filled} small holes")
    if slits:
        surface.repairs.append(f"left {slits} slits without width")


def join_bodies(surface: RepairedSurface) -> int:
    """Unite closed bodies that overlap, so that no face lies inside the material.

    Returns:
        The number of separate bodies afterwards.
    """
    body = bodies(surface)
    count = int(body.max()) + 1
    if count == 1 or not is_watertight(surface.faces):
        return count
    # Seen from a vertex: a solid's coordinates are float32.
    centre = surface.vertices[0].copy()
    vertices = (surface.vertices - centre).astype(np.float32)
    parts = []
    for k in range(count):
        used, inverse = np.unique(surface.faces[body == k], return_inverse=True)
        parts.append(Manifold(ManifoldMesh(vertices[used], inverse.reshape(-1, 3).astype(np.uint32))))
    # A wall of a cavity is a body of negative volume: only whole solids can be united.
    if any(part.status() != Error.NoError or part.volume() <= 0.0 for part in parts):
        return count
    joined = sum(parts[1:], parts[0])
    after = len(joined.decompose())
    if after == count and joined.num_tri() == len(surface.faces):
        return count
    raw = joined.to_mesh64()
    surface.vertices = np.asarray(raw.vert_properties, np.float64)[:, :3] + centre
    surface.faces = np.asarray(raw.tri_verts, np.int64)
    surface.repairs.append(f"joined {count} overlapping bodies into {after}")
    return after


def take_apart(surface: RepairedSurface) -> None:
    """Give solids that touch in an edge, a point or a face a surface each, where each is closed by itself.

    Around an edge of more than two faces those are neighbours that have material between them, by the way
    that the file's faces turn. Where that does not make closed solids, nothing is changed.
    """
    faces, count = surface.faces, len(surface.faces)
    directed = np.vstack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    forward = directed[:, 0] < directed[:, 1]
    _, edge = np.unique(row_keys(np.sort(directed, axis=1)), return_inverse=True)
    owner, order = np.tile(np.arange(count), 3), np.argsort(edge.ravel(), kind="stable")
    starts = np.flatnonzero(np.r_[True, np.diff(edge.ravel()[order]) > 0, True])
    lengths = np.diff(starts)
    plain = order[starts[:-1][lengths == 2]], order[starts[:-1][lengths == 2] + 1]
    pairs = [np.column_stack([owner[plain[0]], owner[plain[1]]])]
    for start, length in zip(starts[:-1][lengths > 2], lengths[lengths > 2], strict=True):
        around = order[start : start + length]
        joined = _with_material_between(_angles(surface, directed[around[0]], owner[around]), forward[around])
        pairs.append(owner[around][joined])
    joined_faces = np.concatenate(pairs)
    graph = coo_array((np.ones(len(joined_faces)), tuple(joined_faces.T)), shape=(count, count))
    solid = np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)
    count = int(solid.max()) + 1
    if count == int(bodies(surface).max()) + 1:
        return
    if any(len(boundary_edges(surface.faces[solid == k])) for k in range(count)):
        return
    keys = solid[:, None] * len(surface.vertices) + surface.faces
    used, faces = np.unique(keys, return_inverse=True)
    surface.vertices = surface.vertices[used % len(surface.vertices)]
    surface.faces = faces.reshape(-1, 3).astype(np.int64)
    surface.repairs.append(f"took {count} solids apart that meet in an edge, a point or a face")


def _angles(surface: RepairedSurface, edge: IntArray, around: IntArray) -> FloatArray:
    """``(k,)`` in steps of ``_SAME_ANGLE``: where faces stand about their edge, lesser vertex to greater."""
    start, end = surface.vertices[edge.min()], surface.vertices[edge.max()]
    along = (end - start) / np.linalg.norm(end - start)
    corners = surface.faces[around]
    third = corners[(corners != edge[0]) & (corners != edge[1])]
    arms = surface.vertices[third] - start
    arms = arms - (arms @ along)[:, None] * along
    across = np.cross(along, arms[0])
    angles = np.arctan2(arms @ across, np.linalg.norm(arms[0]) * (arms @ arms[0]))
    steps = np.round(2.0 * np.pi / _SAME_ANGLE)
    return np.asarray(np.round(angles / _SAME_ANGLE) % steps)


def _with_material_between(angles: FloatArray, forward: BoolArray) -> IntArray:
    """``(p, 2)`` of faces about an edge, those that bound one material; none where they do not take turns.

    A face that runs forward along the edge has its material before it, one that runs backward behind it.
    """
    # Of two faces that lie on each other the one that ends material comes first.
    order = np.lexsort((~forward, angles))
    ends = forward[order]
    if len(order) % 2 or (ends == np.roll(ends, 1)).any():
        return np.zeros((0, 2), dtype=np.int64)
    begins = np.flatnonzero(~ends)
    return np.column_stack([order[begins], order[(begins + 1) % len(order)]])
