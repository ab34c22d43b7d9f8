"""Tetrahedra out of any file that meshio reads, solved on their own nodes or refused by number."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.errors import MeshRefused, WrongUse
from harness.basics.geometry import rotate_upright
from harness.sim.solid.coordinates import move_near
from harness.sim.solid.formats.cells import CellFile
from harness.sim.solid.intake import read_line
from harness.sim.solid.mesh_read import METRES, SOLIDS, TETRAHEDRA, choose_up_axis, mesh_kind, read_cells
from harness.sim.solid.modal_mesh import QuadraticMesh, quadratic_mesh, six_node_faces
from harness.sim.solid.tetrahedra import signed_volumes
from harness.sim.solid.volume_mesh_checks import (
    check_curved,
    check_full,
    check_overlap,
    check_shared,
    joints,
    ordered_middles,
    turned,
)

_SURFACES_ONLY = frozenset({".obj", ".stl", ".stl_ascii", ".ply", ".off", ".glb", ".gltf", ".3mf", ".dae"})
_READINGS = ("m", "cm", "mm")
_SMALLEST, _LARGEST = 5e-3, 2.0


@dataclass(frozen=True, eq=False)
class VolumeMesh:
    """What a file holds, ready to be solved.

    Attributes:
        mesh: in metres, corners first, positively oriented.
        sets: nodes by the name that the file gives them, numbered as in ``mesh``.
        corners: nodes of a cell in the file: 4 or 10.
        units: the unit its numbers were taken in.
        bodies: separate pieces.
        quality: the least fullness of a cell (see ``harness.sim.solid.tetrahedra.fullness``), times
            ``6 sqrt(2)``: 1 where all are regular, 0 where one is flat.
        said: what was read, what was done to the mesh and what to look at, a sentence each.
    """

    mesh: QuadraticMesh
    sets: Mapping[str, IntArray]
    corners: int
    units: str
    bodies: int
    quality: float
    said: tuple[str, ...]


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
    nodes, cells, number, said = _compacted(nodes, cells, path.name)
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
        (summary, *read.notes, *moved, *said, *done, *warned),
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
    said = (f"{unused} nodes that no element holds are left out",) if unused else ()
    return nodes[kept], number[cells], number, said


def _oriented(nodes: FloatArray, cells: IntArray) -> tuple[QuadraticMesh, tuple[str, ...], float]:
    """Cells turned the right way and checked, and what was done."""
    said: list[str] = []
    check_full(nodes, cells)
    if cells.shape[1] == 10:
        cells = ordered_middles(nodes, cells, said)
        check_shared(cells)
    cells, reversed_ = turned(nodes, cells)
    check_overlap(cells, reversed_)
    if reversed_.any() and not reversed_.all():
        said.append(f"{int(reversed_.sum())} elements were numbered the other way round and are turned")
    if cells.shape[1] == 4:
        mesh = quadratic_mesh(nodes, cells)
        added = len(mesh.nodes) - len(nodes)
        said.append(f"the cells have four nodes, too stiff to be solved; {added} middle nodes were added")
    else:
        mesh = QuadraticMesh(nodes, cells, six_node_faces(cells))
    quality = check_curved(mesh, said)
    return mesh, tuple(said), quality


def _unit(asked: str | None, size: float, name: str) -> tuple[str, str]:
    """The unit, and where it came from."""
    if asked is not None:
        return asked, "asked"
    fit = [unit for unit in _READINGS if _SMALLEST <= size * METRES[unit] <= _LARGEST]
    if len(fit) == 1:
        return fit[0], "the only reading of its size"
    said = " or ".join(f"{size:.4g} {unit} ({size * METRES[unit]:.3g} m)" for unit in fit or _READINGS)
    raise WrongUse(f"{name}: the longest side is {size:.4g}: {said}? say --units m, cm, mm or in")
