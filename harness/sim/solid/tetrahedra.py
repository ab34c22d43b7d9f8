"""A surface filled with tetrahedra, or refused: never a shell that became a ball."""

import contextlib
from dataclasses import dataclass
from functools import cached_property
from tempfile import TemporaryDirectory

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from harness.basics.arrays import FloatArray, IntArray, read_only, row_keys
from harness.basics.errors import MeshRefused, WrongUse
from harness.basics.mesh import Mesh, signed_volume
from harness.objects.solid import from_manifold, to_manifold
from harness.sim.solid.mesh_repair import boundary_edges
from harness.sim.solid.modal_kernels import EDGES, MASS_POINTS, STIFFNESS_POINTS, determinants, shape_slopes
from harness.sim.solid.walls import enclosed_volume, thin_wall

FACES = np.array([(1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1)])
"""Corners of the face opposite each corner, outward where the cell is positively oriented."""

_CHECKED_AT = np.vstack([STIFFNESS_POINTS, MASS_POINTS, np.eye(4)])


@dataclass(frozen=True, eq=False)
class QuadraticMesh:
    """Tetrahedra with a node in the middle of every edge."""

    nodes: FloatArray  #: ``(n, 3)`` m; the corners first, in their old order.
    cells: IntArray  #: ``(c, 10)`` corners, and middles of the edges in the order of ``EDGES``.
    faces: IntArray  #: ``(f, 6)`` of the surface, outward: corners a, b, c and middles of ab, bc, ca.

    @property
    def triangles(self) -> IntArray:
        """``(4 f, 3)``: every face of the surface as four triangles of nodes, outward."""
        a, b, c, ab, bc, ca = self.faces.T
        parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        return np.concatenate([np.stack(part, axis=1) for part in parts])


ENVELOPE_OF_WALL = 0.2
"""Of the thinnest wall, how far the tetrahedra may leave the surface. With what leaving out faces
takes, both sides of a wall come no nearer than two fifths of it."""

_ENVELOPE_OF_SIZE = 2e-3
_ENVELOPE_OF_EDGE = 0.03
"""Of the edge aimed at: smaller elements follow the surface more closely, or they gain nothing."""

FLATTEST = 1e-8
"""Least volume of a cell as a share of its edges' root mean square cubed: below it, stiffness
grows so large that the eigenvalues lose their digits."""

_MAX_CELLS = 5_000_000
"""Cells of one object: more exceed the memory of usual computers."""

_SLIT = 1e-6
"""Of the surface's area, what may be open: an edge along which a face without area was left out."""

_VOLUME_GATE = 0.15
"""Relative: what flat faces and the envelope may take from a thin wall before its nodes are moved
onto the surface. A shell that was filled or lost is far beyond it."""

_SIMPLIFIED = 0.5
"""Of the envelope, how far the surface may move, beside it, to leave out faces before it is filled."""

_TRIES = ((1.0, 1.0), (1.0, 0.5), (0.5, 0.25))
"""Of the edge and of the envelope, those that a surface is filled with in turn while a neck or a wall of it
is lost: how near two sides come is the envelope's doing first, and the elements' next."""

_MM = 1e-3
_STOP_ENERGY = 20.0
"""At which fTetWild stops improving cells; 10 is its default, a regular tetrahedron has 3."""


class _Lost(MeshRefused):
    """What fills a surface is not what it encloses; finer elements may."""


@dataclass(frozen=True, eq=False)
class Tetrahedra:
    """A volume mesh."""

    nodes: FloatArray  #: ``(n, 3)`` m, each the corner of some cell.
    cells: IntArray  #: ``(c, 4)``, positively oriented.

    @cached_property
    def volumes(self) -> FloatArray:
        """``(c,)`` m^3."""
        return read_only(signed_volumes(self.nodes, self.cells))

    @cached_property
    def body(self) -> IntArray:
        """``(c,)``: which of the separate bodies each cell belongs to."""
        ends = np.repeat(self.cells[:, :1], 3, axis=1).ravel(), self.cells[:, 1:].ravel()
        graph = coo_array((np.ones(len(ends[0])), ends), shape=(len(self.nodes), len(self.nodes)))
        number = np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)
        return read_only(number[self.cells[:, 0]])

    @property
    def bodies(self) -> int:
        """How many bodies touch nowhere."""
        return int(self.body.max()) + 1

    @cached_property
    def surface(self) -> Mesh:
        """The faces of one cell only, outward; its vertices are ``nodes``."""
        return Mesh(self.nodes, boundary_faces(self.cells))


def tetrahedra(nodes: FloatArray, cells: IntArray) -> Tetrahedra:
    """Checked cells of any origin: turned the right way, without unused nodes.

    Args:
        nodes: ``(n, 3)`` m.
        cells: ``(c, 4)`` in any orientation.

    Raises:
        MeshRefused: a node that is not finite, a cell without volume, or a face of three cells.
    """
    used, cells = np.unique(np.asarray(cells, dtype=np.int64), return_inverse=True)
    nodes, cells = np.array(nodes, dtype=np.float64)[used], cells.reshape(-1, 4).copy()
    if len(cells) == 0 or not np.isfinite(nodes).all():
        raise MeshRefused(
            f"a volume mesh of {len(cells)} cells with finite corners makes no sound; export it again"
        )
    volumes = signed_volumes(nodes, cells)
    cells[volumes < 0.0] = cells[volumes < 0.0][:, [0, 2, 1, 3]]
    quality = fullness(nodes, cells)
    bad = int(np.count_nonzero(quality < FLATTEST))
    if bad:
        raise MeshRefused(
            f"{bad} of {len(cells)} tetrahedra are flat (the worst has {quality.min():.1e} of its edges' "
            f"volume, the least is {FLATTEST:g}); mesh the object again, or collapse them"
        )
    boundary_faces(cells)
    return Tetrahedra(read_only(nodes), read_only(cells))


def tetrahedralize(
    mesh: Mesh, edge: float, envelope: float | None = None, stop: float = _STOP_ENERGY
) -> Tetrahedra:
    """Fill a closed surface with fTetWild (Hu et al., Fast Tetrahedral Meshing in the Wild, 2020).

    Where a thin neck or a wall is lost it is filled again, more closely, and refused only then.

    Args:
        mesh: closed, outward; parts that overlap count once.
        edge: m, longest edge aimed at; where the surface bends or is thin they are shorter.
        envelope: m, how far the cells may leave the surface; None for a fifth of the thinnest
            wall, and no more than 3 % of the edge and 0.2 % of the mesh's diagonal.
        stop: the energy of the worst cell at which fTetWild stops; above 3, that of a regular one. It
            also stops there where edges are still longer than asked for.

    Raises:
        WrongUse: an edge or an envelope that cannot be.
        MeshRefused: the surface is open, or what fills it is not what it encloses.
    """
    check_closed(mesh)
    if not (np.isfinite(edge) and 0.0 < edge < mesh.diagonal):
        raise WrongUse(
            f"an element edge of {edge * 1e3:g} mm is outside 0 to {mesh.diagonal * 1e3:.4g} mm, the "
            "diagonal of the object; say one in between"
        )
    # Regular tetrahedra of this edge are fewer than the real ones.
    count = abs(signed_volume(mesh)) * 6.0 * np.sqrt(2.0) / edge**3
    if count > _MAX_CELLS:
        shortest = 1.01 * edge * np.cbrt(count / _MAX_CELLS)
        raise WrongUse(
            f"an element edge of {edge * 1e3:g} mm needs about {count:.2g} elements; at most {_MAX_CELLS:,} "
            f"are made: give an edge of at least {shortest * 1e3:.3g} mm"
        )
    wall = thin_wall(mesh)
    if envelope is None:
        envelope = min(ENVELOPE_OF_WALL * wall, _ENVELOPE_OF_EDGE * edge, _ENVELOPE_OF_SIZE * mesh.diagonal)
    if not 0.0 < envelope <= 0.25 * wall:
        raise WrongUse(
            f"an envelope of {envelope * 1e3:.3g} mm lets a wall of {wall * 1e3:.3g} mm close up; say one "
            f"above 0 and up to {0.25 * wall * 1e3:.3g} mm"
        )
    for of_edge, of_envelope in _TRIES[:-1]:
        with contextlib.suppress(_Lost):
            return _filled_whole(mesh, of_edge * edge, of_envelope * envelope, stop)
    finest_edge, finest_envelope = _TRIES[-1]
    return _filled_whole(mesh, finest_edge * edge, finest_envelope * envelope, stop)


def _filled_whole(mesh: Mesh, edge: float, envelope: float, stop: float) -> Tetrahedra:
    found = tetrahedra(*_filled(mesh, edge, envelope, stop))
    wanted, got = enclosed_volume(mesh), float(found.volumes.sum())
    if not abs(got - wanted) <= _VOLUME_GATE * wanted:
        raise _Lost(
            f"the tetrahedra hold {got * 1e6:.4g} cm^3 where the surface encloses {wanted * 1e6:.4g}, more "
            f"than {_VOLUME_GATE:.0%} apart, with edges of {edge * 1e3:.3g} mm at an envelope of "
            f"{envelope * 1e3:.3g} mm, the finest that were tried; repair the surface"
        )
    ends = mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]]
    rows, columns = (np.concatenate([pair[:, k] for pair in ends]) for k in (0, 1))
    graph = coo_array((np.ones(len(rows)), (rows, columns)), shape=(len(mesh.vertices),) * 2)
    number = connected_components(graph, directed=False)[1]
    pieces = len(np.unique(number[np.unique(mesh.faces)]))
    bodies = joined_by_faces(found.cells)
    if bodies > pieces:
        raise _Lost(
            f"the tetrahedra fall into {bodies} bodies where the surface has {pieces}: a thin neck, or "
            f"an edge only, was lost even with elements of {edge * 1e3:.3g} mm, the finest that were tried; "
            "thicken it"
        )
    return found


def _filled(mesh: Mesh, edge: float, envelope: float, stop: float) -> tuple[FloatArray, IntArray]:
    from pytetwild.pytetwild import tetrahedralize as fill

    fewer = _simplified(mesh, _SIMPLIFIED * envelope)
    # fTetWild leaves a file of its own in the folder it runs in.
    with TemporaryDirectory(prefix="touchstone-fill-") as folder, contextlib.chdir(folder):
        nodes, cells = fill(
            fewer.vertices.copy(),
            fewer.faces.astype(np.int32),
            edge_length_abs=edge,
            simplify=False,
            epsilon=envelope / fewer.diagonal,
            stop_energy=stop,
            num_threads=1,
            vtk_ordering=True,
        )
    return np.asarray(nodes, dtype=np.float64), np.asarray(cells, dtype=np.int64)


def _simplified(mesh: Mesh, tolerance: float) -> Mesh:
    """Fewer faces, none of them further than ``tolerance`` m away: filling takes as long as they are many."""
    try:
        # Seen from a vertex: its coordinates become float32.
        solid = to_manifold(Mesh((mesh.vertices - mesh.vertices[0]) / _MM, mesh.faces))
    except ValueError:
        return mesh
    fewer = from_manifold(solid.simplify(tolerance / _MM))
    return Mesh(fewer.vertices * _MM + mesh.vertices[0], fewer.faces)


def signed_volumes(nodes: FloatArray, cells: IntArray) -> FloatArray:
    """``(c,)`` m^3, below zero where a cell is numbered the other way round."""
    a, b, c, d = (nodes[cells[:, corner]] for corner in range(4))
    volumes: FloatArray = np.einsum("ij,ij->i", b - a, np.cross(c - a, d - a)) / 6.0
    return volumes


def fullness(nodes: FloatArray, cells: IntArray) -> FloatArray:
    """``(c,)``: volume over the cube of the edges' root mean square; 0.118 where regular, 0 where flat."""
    pairs = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)]
    squares = sum(((nodes[cells[:, a]] - nodes[cells[:, b]]) ** 2).sum(axis=1) for a, b in pairs) / 6.0
    return np.abs(signed_volumes(nodes, cells)) / np.where(squares > 0.0, squares, 1.0) ** 1.5


def check_closed(mesh: Mesh) -> None:
    """Refuse a surface without an inside.

    Raises:
        MeshRefused: it is open.
    """
    rim = boundary_edges(mesh.faces)
    if len(rim) and _open_area(mesh, rim) > _SLIT * float(mesh.face_areas.sum()):
        raise MeshRefused(
            f"the surface is open ({len(rim)} rim edges), so that it has no inside to sound; close it, or "
            "say how thick its wall is (--wall)"
        )


def _open_area(mesh: Mesh, rim: IntArray) -> float:
    """Square metres of fans that would close every rim; a slit left by a flat face has none."""
    ends = mesh.vertices[rim]
    graph = coo_array((np.ones(len(rim)), (rim[:, 0], rim[:, 1])), shape=(len(mesh.vertices),) * 2)
    loop = connected_components(graph, directed=False)[1][rim[:, 0]]
    area = 0.0
    for number in np.unique(loop):
        mine = ends[loop == number]
        spokes = mine - mine.reshape(-1, 3).mean(axis=0)
        area += 0.5 * float(np.linalg.norm(np.cross(spokes[:, 0], spokes[:, 1]), axis=1).sum())
    return area


def joined_by_faces(cells: IntArray) -> int:
    """How many parts ``(c, 4)`` cells make that count as joined only where they share a face."""
    faces = np.sort(cells[:, FACES].reshape(-1, 3), axis=1)
    _, which = np.unique(row_keys(faces), return_inverse=True)
    owner = np.repeat(np.arange(len(cells)), len(FACES))
    shape = (len(cells) + len(faces),) * 2
    joined = coo_array((np.ones(len(owner)), (owner, len(cells) + which.ravel())), shape=shape)
    number = connected_components(joined, directed=False)[1]
    return len(np.unique(number[: len(cells)]))


def quadratic_mesh(nodes: FloatArray, cells: IntArray) -> QuadraticMesh:
    """Straight ten-node tetrahedra of four-node ones.

    Args:
        nodes: ``(n, 3)`` m, each the corner of some cell.
        cells: ``(c, 4)``, positively oriented.
    """
    pairs = np.sort(cells[:, EDGES], axis=2).reshape(-1, 2)
    keys = pairs[:, 0] * len(nodes) + pairs[:, 1]
    unique, which = np.unique(keys, return_inverse=True)
    ends = np.stack(np.divmod(unique, len(nodes)), axis=1)
    middles = nodes[ends].mean(axis=1)
    whole = np.concatenate([cells, len(nodes) + which.reshape(-1, 6)], axis=1)
    return QuadraticMesh(np.concatenate([nodes, middles]), whole, six_node_faces(whole))


def boundary_faces(cells: IntArray) -> IntArray:
    """``(f, 3)``: the faces that belong to one cell only, outward.

    Raises:
        MeshRefused: a face that more than two cells share.
    """
    faces = cells[:, FACES].reshape(-1, 3)
    _, first, counts = np.unique(row_keys(np.sort(faces, axis=1)), return_index=True, return_counts=True)
    if (counts > 2).any():
        raise MeshRefused(
            f"{int((counts > 2).sum())} faces of the tetrahedra are shared by more than two of them; "
            "the volume mesh overlaps itself: mesh the object again"
        )
    return np.asarray(faces[np.sort(first[counts == 1])], dtype=np.int64)


def six_node_faces(cells: IntArray) -> IntArray:
    """``(f, 6)``: the faces that belong to one of ``(c, 10)`` cells only, as ``QuadraticMesh.faces``.

    Raises:
        MeshRefused: a face that more than two cells share.
    """
    count = int(cells.max()) + 1
    ends = np.sort(cells[:, EDGES], axis=2).reshape(-1, 2)
    edges, first = np.unique(ends[:, 0] * count + ends[:, 1], return_index=True)
    faces = boundary_faces(cells[:, :4])
    sides = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2), axis=2)
    middles = cells[:, 4:].ravel()[first[np.searchsorted(edges, sides[..., 0] * count + sides[..., 1])]]
    return np.concatenate([faces, middles], axis=1)


def middles_of(nodes: FloatArray, cells: IntArray, count: int) -> FloatArray:
    """``(count, 3)``: at the index of a middle node the middle of its edge, elsewhere zero."""
    middles = np.zeros((count, 3))
    middles[cells[:, 4:]] = nodes[cells[:, EDGES]].mean(axis=2)
    return middles


def least_determinant(mesh: QuadraticMesh) -> FloatArray:
    """``(c,)`` m^3: six times the volume that each cell would have if it were everywhere as at its worst."""
    least: FloatArray = determinants(mesh.nodes, mesh.cells, shape_slopes(_CHECKED_AT)).min(axis=1)
    return least
