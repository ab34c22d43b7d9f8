"""Triangles out of any file that trimesh or meshio reads, exactly as they stand in it."""

import io
import warnings
from contextlib import redirect_stdout
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from harness.basics.arrays import FloatArray, IntArray, row_keys
from harness.basics.errors import MeshRefused, WrongUse
from harness.basics.files.foreign_file import MOST_DATA, require_readable
from harness.basics.files.named_file import require_file
from harness.basics.geometry import rotate_upright
from harness.sim.solid.coordinates import move_near
from harness.sim.solid.formats.abaqus import read_abaqus
from harness.sim.solid.formats.cells import CellBlock, CellFile
from harness.sim.solid.formats.collada import read_collada
from harness.sim.solid.formats.gltf import read_gltf
from harness.sim.solid.formats.nastran import read_nastran
from harness.sim.solid.formats.parts import merge_parts
from harness.sim.solid.formats.three_mf import read_3mf
from harness.sim.solid.plain_formats import plain_file, read_obj, read_off, read_ply, read_stl

METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254, "ft": 0.3048}
"""Metres in one unit of a mesh file, by the unit's name."""

_PLAIN = {".obj": read_obj, ".stl": read_stl, ".stl_ascii": read_stl, ".off": read_off, ".ply": read_ply}

DECLARING = {".glb": read_gltf, ".gltf": read_gltf, ".3mf": read_3mf, ".dae": read_collada}
"""Readers of the formats that declare units, axes or colours, by the endings of their files."""

_OFTEN = "OBJ, STL, PLY, OFF, glTF, 3MF, COLLADA, or tetrahedra as Gmsh, VTK, Abaqus or Nastran write them"
_OF_ELEMENTS = {".inp": read_abaqus, ".bdf": read_nastran, ".nas": read_nastran, ".fem": read_nastran}
_TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])

SOLIDS = ("hexahedron", "wedge", "pyramid", "tetra")
"""How meshio's names of solid cells begin."""

TETRAHEDRA = {"tetra": 4, "tetra4": 4, "tetra10": 10}
"""Nodes of a cell of the kinds that are read."""

UP_AXES = ("x", "y", "z")

_COORDINATES = (1e-30, 1e30)
"""Distances from the origin that are read, in the file's unit: their squares and cubes are numbers."""


@dataclass(frozen=True, eq=False)
class RawMesh:
    """A file's triangles before anything is done to them."""

    vertices: FloatArray
    """``(n, 3)`` in the file's unit, rotated about the file's origin until its up axis is z; may repeat, may
    not be numbers."""
    faces: IntArray  #: ``(m, 3)`` indices.
    unit: str | None
    """name of the unit that the file declares, e.g. ``"in"`` or ``"0.1 m"``; None where there is none."""
    notes: tuple[str, ...] = ()  #: what is odd of the file, a sentence each.
    single: bool = False  #: the file holds float32 coordinates.
    metres: float | None = None  #: length of that unit in metres.
    up_axis: str = ""  #: how the file was rotated, for people; empty where z was up.


def read_mesh(path: Path, up_axis: str | None = None) -> RawMesh:
    """Read the triangles of a file; polygons are split, tetrahedra give their outside and nothing else.

    Args:
        path: the file.
        up_axis: axis of the file that points up, "x", "y" or "z"; None for the one that it declares, else z.

    Raises:
        WrongUse: no such file or axis.
        MeshRefused: an empty one, one that does not parse, or no triangle in it.
    """
    require_file(path, "mesh file")
    require_readable(path, "a mesh", MOST_DATA, MeshRefused)
    if path.stat().st_size == 0:
        raise MeshRefused(f"{path.name} is empty (0 bytes); export it again")
    kind = mesh_kind(path)
    read = _plain if kind in _PLAIN else _declaring if kind in DECLARING else _with_meshio
    if read is _with_meshio:
        import meshio

        if kind not in meshio.extension_to_filetypes:
            raise MeshRefused(f"{path.name}: {kind or 'no ending'} is not that of a mesh; give {_OFTEN}")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            raw = read(path)
    except MeshRefused:
        raise
    # The readers raise whatever their parsers meet: there is no common class to name.
    except (Exception, SystemExit) as error:
        raise MeshRefused(
            f"{path.name} does not read as {path.suffix or 'a mesh'}: it is cut short, damaged or of another "
            "format; export it again"
        ) from error
    if len(raw.faces) == 0:
        raise MeshRefused(f"{path.name} holds no triangle ({len(raw.vertices)} vertices); export a surface")
    least, most = int(raw.faces.min()), int(raw.faces.max())
    if least < 0 or most >= len(raw.vertices):
        raise MeshRefused(
            f"{path.name} has a face with vertex {most if most >= len(raw.vertices) else least}, "
            f"but {len(raw.vertices)} vertices; the file is cut short or damaged, export it again"
        )
    check_extent(raw.vertices, raw.faces, path.name)
    vertices, moved = move_near(raw.vertices, raw.faces, path.name, raw.single)
    axis, rotated = choose_up_axis(up_axis, raw.up_axis or None)
    vertices = rotate_upright(vertices, axis)
    return replace(raw, vertices=vertices, notes=(*raw.notes, *moved), up_axis=rotated)


def check_extent(vertices: FloatArray, faces: IntArray, name: str) -> None:
    """Refuse coordinates whose squares and cubes are no numbers; intake refuses those that are none."""
    low, high = _COORDINATES
    used = vertices[np.unique(faces)]
    finite = used[np.isfinite(used).all(axis=1)]
    largest = float(np.abs(finite).max(initial=0.0))
    if largest > high or 0.0 < largest < low:
        raise MeshRefused(
            f"{name} has coordinates of up to {largest:.3g}; {low:g} to {high:g} are read, export it again"
        )


def _plain(path: Path) -> RawMesh:
    found = _PLAIN[mesh_kind(path)](path)
    return RawMesh(found.vertices, found.faces, None, found.notes, found.single)


def mesh_kind(path: Path) -> str:
    """Return the ending that names a mesh file's format, in lower case and without a ``.gz`` after it."""
    return Path(path.name.lower().removesuffix(".gz")).suffix


def _declaring(path: Path) -> RawMesh:
    read = DECLARING[path.suffix.lower()](path)
    vertices, faces = merge_parts(read.parts)
    unit = None if read.metres is None else unit_name(read.metres)
    return RawMesh(vertices, faces, unit, read.notes, metres=read.metres, up_axis=read.up_axis or "")


def unit_name(metres: float) -> str:
    """Name a unit by its length in metres: one of ``METRES``, or the length itself."""
    named = (name for name, size in METRES.items() if np.isclose(metres, size, rtol=1e-6, atol=0.0))
    return next(named, f"{metres:g} m")


def choose_up_axis(requested: str | None, declared: str | None) -> tuple[str, str]:
    """Choose the axis of a file that points up.

    Args:
        requested: by the operator: "x", "y" or "z"; None to use the file's.
        declared: by the file or its format; None where it declares none.

    Returns:
        The axis; and how the file is rotated, for people, empty where it is not.

    Raises:
        WrongUse: another axis.
    """
    if requested not in (None, *UP_AXES):
        raise WrongUse(f"unknown up axis {requested!r}; give one of {', '.join(UP_AXES)}")
    if requested is None:
        axis = declared or "z"
        return axis, "" if axis == "z" else f"{axis} is up (declared by the file), rotated to z"
    against = f", against the {declared} that the file declares" if declared not in (None, requested) else ""
    rotated = "" if requested == "z" else ", rotated to z"
    return requested, f"{requested} is up (requested{against}){rotated}" if against or rotated else ""


def _with_meshio(path: Path) -> RawMesh:
    mesh = read_cells(path)
    # Surface cells of any order, by their corner nodes.
    faces = []
    for block in mesh.cells:
        if block.type.startswith("triangle"):
            faces.append(block.data[:, :3])
        elif block.type.startswith("quad"):
            faces += [block.data[:, [0, 1, 2]], block.data[:, [0, 2, 3]]]
    kinds = {block.type for block in mesh.cells if block.type.startswith(SOLIDS)}
    notes: tuple[str, ...] = ()
    if kinds:
        sides = sum(len(part) for part in faces)
        notes = (f"{sides} faces of named sides are no surface of their own: left out",) if sides else ()
        if not kinds <= TETRAHEDRA.keys():
            raise MeshRefused(
                f"{path.name} holds cells of kind {', '.join(sorted(kinds))}; export it as four-node "
                "tetrahedra only, or ten-node ones only"
            )
        cells = np.concatenate([block.data[:, :4] for block in mesh.cells if block.type in kinds])
        # The faces that belong to one tetrahedron only.
        outward = cells[:, _TETRAHEDRON].reshape(-1, 3)
        corners = np.sort(outward, axis=1)
        _, first, count = np.unique(row_keys(corners), return_index=True, return_counts=True)
        faces = [outward[first[count == 1]]]
    points = np.zeros((len(mesh.points), 3))
    points[:, : mesh.points.shape[1]] = mesh.points
    every = np.vstack([np.zeros((0, 3), np.int64), *faces])
    return RawMesh(points, every, None, (*mesh.notes, *notes), mesh.single)


def read_cells(path: Path) -> CellFile:
    """Read the nodes and cells of a file of finite elements."""
    if mesh_kind(path) in _OF_ELEMENTS:
        return _OF_ELEMENTS[mesh_kind(path)](path)
    import meshio

    # The library prints to standard output, which is for answers alone.
    with warnings.catch_warnings(), redirect_stdout(io.StringIO()), plain_file(path) as readable:
        warnings.simplefilter("ignore")
        found = meshio.read(readable)
    cells = tuple(CellBlock(block.type, np.asarray(block.data, np.int64)) for block in found.cells)
    single = np.asarray(found.points).dtype == np.float32
    return CellFile(np.asarray(found.points, np.float64), cells, found.point_sets, (), single)
