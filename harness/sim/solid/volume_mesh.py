"""Tetrahedra out of any file that meshio reads, solved on their own nodes or refused by number."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from harness.basics.arrays import BoolArray, FloatArray, IntArray, row_keys
from harness.basics.errors import MeshRefused, WrongUse
from harness.basics.geometry import rotate_upright
from harness.sim.solid.coordinates import move_near
from harness.sim.solid.formats.cells import CellFile
from harness.sim.solid.intake import read_line
from harness.sim.solid.mesh_read import METRES, SOLIDS, TETRAHEDRA, choose_up_axis, mesh_kind, read_cells
from harness.sim.solid.modal_kernels import EDGES
from harness.sim.solid.tetrahedra import (
    FACES,
    FLATTEST,
    QuadraticMesh,
    fullness,
    joined_by_faces,
    least_determinant,
    quadratic_mesh,
    signed_volumes,
    six_node_faces,
)

_SURFACES_ONLY = frozenset({".obj", ".stl", ".stl_ascii", ".ply", ".off", ".glb", ".gltf", ".3mf", ".dae"})
_READINGS = ("m", "cm", "mm")
_SMALLEST, _LARGEST = 5e-3, 2.0

REGULAR = 6.0 * np.sqrt(2.0)
"""Times the fullness of a cell is its quality, 1 where it is regular."""

_POOR = 1e-3
"""Quality below which a cell is worth a word."""

_ASTRAY = 0.4
"""Of an edge, how far its middle node may lie from its middle; at a quarter along the edge the
element is singular, and no bend of a useful one is as deep."""

_REVERSED = np.array([0, 2, 1, 3, 6, 5, 4, 7, 9, 8])
"""The nodes of a cell from the other side: corners 1 and 2 change places."""

_COINCIDENT = 1e-9
_NAMED = 4


@dataclass(frozen=True, eq=False)
class VolumeMesh:
    """What a file holds, ready to be solved."""

    mesh: QuadraticMesh  #: in metres, corners first, positively oriented.
    sets: Mapping[str, IntArray]  #: nodes by the name that the file gives them, numbered as in ``mesh``.
    corners: int  #: nodes of a cell in the file: 4 or 10.
    units: str  #: the unit its numbers were taken in.
    bodies: int  #: separate pieces.
    quality: float
    """the least fullness of a cell (see ``harness.sim.solid.tetrahedra.fullness``), times ``6 sqrt(2)``: 1
    where all are regular, 0 where one is flat."""
    said: tuple[str, ...]  #: what was read, what was done to the mesh and what to look at, a sentence each.


def read_volume(path: Path, units: str | None = None, up_axis: str | None = None) -> VolumeMesh | None:
    """The tetrahedra of a file; ten-node ones as they are, four-node ones with a node in every edge.

    Cells that are numbered the other way round are turned, unused nodes left out, and middle nodes
    put in order where the whole file has them in another; all of that is said. Cells are named by
    their number in the file, from 1.

    Args:
        path: any file that meshio reads.
        units: "m", "cm", "mm" or "in", of any size; None for the only one of m, cm and mm in which
            the longest side is between 5 mm and 2 m.
        up_axis: axis of the file that points up, "x", "y" or "z", as at intake; None for z.

    Returns:
        None where the file holds no tetrahedra: it is for ``harness.sim.solid.intake``.

    Raises:
        WrongUse: an unknown unit, or no unit and several that could be.
        MeshRefused: a file that does not read, or cells that cannot be solved, by number.
    """
    if units is not None and units not in METRES:
        raise WrongUse(f"unknown unit {units!r} for a mesh; say one of {', '.join(METRES)}")
    known = path.is_file() and path.stat().st_size > 0 and mesh_kind(path) not in _SURFACES_ONLY
    read = _read(path) if known else None
    kinds = sorted({block.type for block in read.cells if block.type.startswith(SOLIDS)}) if read else []
    if read is None or not kinds:
        return None
    cells = _cells(read, kinds, path.name)
    nodes = read.points
    nodes, cells, number, notes = _compacted(nodes, cells, path.name)
    nodes, moved = move_near(nodes, cells, path.name, read.single)
    axis, rotated = choose_up_axis(up_axis, None)
    nodes = rotate_upright(nodes, axis)
    longest = float(np.ptp(nodes, axis=0).max())
    unit, source = _unit(units, longest, path.name)
    mesh, done, quality = _oriented(nodes * METRES[unit], cells)
    bodies, warned = joints(mesh)
    named = {name: number[np.asarray(nodes_of, dtype=np.int64)] for name, nodes_of in read.point_sets.items()}
    sets = {name: found[found >= 0] for name, found in named.items()}
    volume = float(signed_volumes(mesh.nodes, mesh.cells).sum())
    size = longest * METRES[unit]
    summary = read_line(path.name, bodies, len(mesh.faces), volume, size, unit, source, rotated)
    return VolumeMesh(
        mesh,
        sets,
        cells.shape[1],
        unit,
        bodies,
        quality,
        (summary, *read.notes, *moved, *notes, *done, *warned),
    )


def _read(path: Path) -> CellFile:
    """Read the cells of a file, or refuse it in one sentence."""
    try:
        return read_cells(path)
    except MeshRefused:
        raise
    # The readers raise whatever their parsers meet, and one of them exits: there is no common class.
    except (Exception, SystemExit) as error:
        raise MeshRefused(
            f"{path.name} does not read as {path.suffix or 'a mesh'}: it is cut short, damaged or of another "
            "format; export it again"
        ) from error


def _cells(read: CellFile, kinds: list[str], name: str) -> IntArray:
    """``(c, 4)`` or ``(c, 10)``: the file's tetrahedra, in their order."""
    if not set(kinds) <= set(TETRAHEDRA) or len({TETRAHEDRA[kind] for kind in kinds}) > 1:
        raise MeshRefused(
            f"{name} holds cells of kind {', '.join(kinds)}; export it as four-node tetrahedra only, or "
            "ten-node ones only"
        )
    cells = np.concatenate([np.asarray(block.data, np.int64) for block in read.cells if block.type in kinds])
    if len(cells) == 0 or cells.min() < 0 or cells.max() >= len(read.points):
        raise MeshRefused(
            f"{name} has {len(cells)} tetrahedra on {len(read.points)} nodes, and some are missing; the file "
            "is cut short or damaged, export it again"
        )
    return cells


def _compacted(
    nodes: FloatArray, cells: IntArray, name: str
) -> tuple[FloatArray, IntArray, IntArray, tuple[str, ...]]:
    """Used nodes, corners first; also ``(n,)`` the new number of each old one, or -1."""
    corners = np.unique(cells[:, :4])
    middles = np.unique(cells[:, 4:])
    both = np.intersect1d(corners, middles)
    if len(both):
        raise MeshRefused(
            f"{name}: {len(both)} nodes are the corner of one element and the middle of another's edge "
            f"(first: node {both[0] + 1}), so that elements do not meet; mesh it again with matching sides"
        )
    kept = np.concatenate([corners, middles])
    if nodes.shape[1] != 3 or not np.isfinite(nodes[kept]).all():
        raise MeshRefused(f"{name}: a node is not three finite numbers; export it again")
    number = np.full(len(nodes), -1)
    number[kept] = np.arange(len(kept))
    unused = len(nodes) - len(kept)
    notes = (f"{unused} nodes that no element holds are left out",) if unused else ()
    return nodes[kept], number[cells], number, notes


def _oriented(nodes: FloatArray, cells: IntArray) -> tuple[QuadraticMesh, tuple[str, ...], float]:
    """Cells turned the right way and checked, and what was done."""
    notes: list[str] = []
    full = fullness(nodes, cells[:, :4])
    if full.min() < FLATTEST:
        raise MeshRefused(
            f"{named(full < FLATTEST)} of {len(cells)} are flat (the worst quality is "
            f"{REGULAR * full.min():.1e}, the least allowed {REGULAR * FLATTEST:.1e}, a regular one's 1): "
            "the stiffness would lose its digits; collapse them, or mesh the object again"
        )
    if cells.shape[1] == 10:
        cells = _order_middle_nodes(nodes, cells, notes)
        _check_shared(cells)
    reversed_ = signed_volumes(nodes, cells) < 0.0
    order = _REVERSED[: cells.shape[1]]
    cells = np.where(reversed_[:, None], cells[:, order], cells)
    _check_overlap(cells, reversed_)
    if reversed_.any() and not reversed_.all():
        notes.append(f"{int(reversed_.sum())} elements were numbered the other way round and are turned")
    if cells.shape[1] == 4:
        mesh = quadratic_mesh(nodes, cells)
        added = len(mesh.nodes) - len(nodes)
        notes.append(f"the cells have four nodes, too stiff to be solved; {added} middle nodes were added")
    else:
        mesh = QuadraticMesh(nodes, cells, six_node_faces(cells))
    quality = _check_curved(mesh, notes)
    return mesh, tuple(notes), quality


def _unit(asked: str | None, size: float, name: str) -> tuple[str, str]:
    """The unit, and where it came from."""
    if asked is not None:
        return asked, "asked"
    fit = [unit for unit in _READINGS if _SMALLEST <= size * METRES[unit] <= _LARGEST]
    if len(fit) == 1:
        return fit[0], "the only reading of its size"
    said = " or ".join(f"{size:.4g} {unit} ({size * METRES[unit]:.3g} m)" for unit in fit or _READINGS)
    raise WrongUse(f"{name}: the longest side is {size:.4g}: {said}? say --units m, cm, mm or in")


def named(chosen: BoolArray) -> str:
    """The numbers of the chosen elements, from 1; beyond four, how many more."""
    numbers = np.flatnonzero(chosen) + 1
    listed = ", ".join(str(number) for number in numbers[:_NAMED])
    more = f" and {len(numbers) - _NAMED} more" if len(numbers) > _NAMED else ""
    return f"element{'s' if len(numbers) > 1 else ''} {listed}{more}"


def _check_overlap(cells: IntArray, reversed_: BoolArray) -> None:
    """Refuse oriented cells on the same side of a shared face; one of the two is reversed."""
    faces = cells[:, FACES].reshape(-1, 3)
    even = (faces < np.roll(faces, -1, axis=1)).sum(axis=1) == 2
    keys = np.column_stack([np.sort(faces, axis=1), even])
    _, which, counts = np.unique(row_keys(keys), return_inverse=True, return_counts=True)
    involved = (counts[which.ravel()] > 1).reshape(-1, 4).any(axis=1)
    if not involved.any():
        return
    blamed = involved & (reversed_ if 2 * int(reversed_.sum()) <= len(cells) else ~reversed_)
    wrong = named(np.asarray(blamed if blamed.any() else involved))
    raise MeshRefused(
        f"{wrong} of {len(cells)} are inverted: they overlap the elements beside them, so a node lies on "
        "the wrong side of a face; mesh the object again, or move the node back"
    )


def _order_middle_nodes(nodes: FloatArray, cells: IntArray, notes: list[str]) -> IntArray:
    """Ten-node cells with each middle node on its own edge.

    Formats differ in the order of the middle nodes. Where a node is far from its edge and one
    order puts all nodes of all cells onto theirs, that is the file's order.

    Raises:
        MeshRefused: there is no such order; the cells are named.
    """
    middles = nodes[cells[:, EDGES]].mean(axis=2)
    lengths = np.linalg.norm(nodes[cells[:, EDGES[:, 0]]] - nodes[cells[:, EDGES[:, 1]]], axis=2)

    def astray(tried: IntArray) -> BoolArray:
        gaps = np.linalg.norm(nodes[tried[:, 4:]] - middles, axis=2)
        found: BoolArray = (gaps > _ASTRAY * lengths).any(axis=1)
        return found

    if not astray(cells).any():
        return cells
    gaps = np.linalg.norm(nodes[cells[:, 4:]][:, :, None] - middles[:, None], axis=3)
    orders, counts = np.unique(gaps.argmin(axis=1), axis=0, return_counts=True)
    likely = orders[np.argmax(counts)]
    tried = np.concatenate([cells[:, :4], cells[:, 4:][:, likely]], axis=1)
    if astray(tried).any():
        bad = astray(cells) if astray(cells).sum() <= astray(tried).sum() else astray(tried)
        raise MeshRefused(
            f"{named(bad)} of {len(cells)} have a middle node far from the middle of its edge; check the "
            "order of the nodes (corners 1 to 4, then edges 12 23 13 14 24 34), or mesh the object again"
        )
    notes.append(
        f"the middle nodes of the elements stood in the order {' '.join(str(5 + place) for place in likely)} "
        "instead of 5 6 7 8 9 10, and are put in order"
    )
    return tried


def _check_shared(cells: IntArray) -> None:
    """Refuse ten-node cells that share an edge but not its middle node."""
    ends = np.sort(cells[:, EDGES], axis=2).reshape(-1, 2)
    _, edge = np.unique(row_keys(ends), return_inverse=True)
    edge = edge.ravel()
    owner = np.zeros(int(edge.max()) + 1, dtype=np.int64)
    owner[edge] = cells[:, 4:].ravel()
    differs = (owner[edge] != cells[:, 4:].ravel()).reshape(-1, 6).any(axis=1)
    if differs.any():
        raise MeshRefused(
            f"{named(differs)} of {len(cells)} share an edge with others but not the node in its middle, so "
            "that the mesh is cracked there; merge coincident nodes and export it again"
        )


def _check_curved(mesh: QuadraticMesh, notes: list[str]) -> float:
    """Return the minimum quality of the cells; report poor cells, refuse inverted ones."""
    straight = 6.0 * signed_volumes(mesh.nodes, mesh.cells)
    share = least_determinant(mesh) / straight
    if share.min() <= 0.0:
        raise MeshRefused(
            f"{named(share <= 0.0)} of {len(mesh.cells)} are turned inside out by their middle nodes (the "
            f"worst has {share.min():.2g} of its straight volume somewhere, which must be above 0); "
            "straighten them, or refine the mesh where it bends"
        )
    quality = REGULAR * fullness(mesh.nodes, mesh.cells) * np.minimum(share, 1.0)
    worst = float(quality.min())
    if worst < _POOR:
        notes.append(
            f"{named(quality < _POOR)} of {len(mesh.cells)} are nearly flat (the worst quality is "
            f"{worst:.1e}, a regular one's 1); they stiffen the mesh around them a little"
        )
    return worst


def joints(mesh: QuadraticMesh) -> tuple[int, tuple[str, ...]]:
    """How many bodies touch nowhere, and what to say of them."""
    cells, count = mesh.cells[:, :4], int(mesh.cells[:, :4].max()) + 1
    ends = np.repeat(cells[:, :1], 3, axis=1).ravel(), cells[:, 1:].ravel()
    graph = coo_array((np.ones(len(ends[0])), ends), shape=(count, count))
    bodies = int(connected_components(graph, directed=False)[0])
    notes = []
    if bodies > 1:
        notes.append(f"{bodies} separate bodies: each has six rigid motions, all left out")
        near = cKDTree(mesh.nodes).query_pairs(_COINCIDENT * float(np.ptp(mesh.nodes, axis=0).max()))
        if near:
            notes.append(f"{len(near)} pairs of nodes coincide: merge them if the bodies are to be one")
    hinged = joined_by_faces(cells) - bodies
    if hinged > 0:
        notes.append(
            f"{hinged} parts are joined to others at an edge or a point only: they may turn about it, and "
            "modes near 0 Hz are such turns"
        )
    return bodies, tuple(notes)
