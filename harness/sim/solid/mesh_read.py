"""Triangles out of any file that trimesh or meshio reads, exactly as they stand in it."""

import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.errors import MeshRefused
from harness.basics.files.named_file import require_file

METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254, "ft": 0.3048}
"""Metres in one unit of a mesh file, by the unit's name."""

_BY_TRIMESH = frozenset({".obj", ".stl", ".stl_ascii", ".ply", ".off", ".glb", ".gltf", ".3mf", ".dae"})
_OFTEN = "OBJ, STL, PLY, OFF, glTF, 3MF, COLLADA, or tetrahedra as Gmsh, VTK, Abaqus or Nastran write them"
_TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
_METRES_BY_DEFINITION = frozenset({".glb", ".gltf"})


@dataclass(frozen=True, eq=False)
class RawMesh:
    """A file's triangles before anything is done to them.

    Attributes:
        vertices: ``(n, 3)`` in the file's unit; may repeat, may not be numbers.
        faces: ``(m, 3)`` indices.
        unit: the unit the file declares, or None.
    """

    vertices: FloatArray
    faces: IntArray
    unit: str | None


def read_mesh(path: Path) -> RawMesh:
    """The triangles of a file; quadrilaterals are split, tetrahedra give their outside.

    Raises:
        WrongUse: no such file.
        MeshRefused: an empty one, one that does not parse, or no triangle in it.
    """
    require_file(path, "mesh file")
    if path.stat().st_size == 0:
        raise MeshRefused(f"{path.name} is empty (0 bytes); export it again")
    kind = path.suffix.lower()
    read = _with_trimesh if kind in _BY_TRIMESH else _with_meshio
    if read is _with_meshio and not _known_to_meshio(kind):
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
    return raw


def _with_trimesh(path: Path) -> RawMesh:
    import trimesh

    loaded = trimesh.load_scene(path, process=False, skip_materials=True, maintain_order=True)
    if not loaded.geometry:
        raise MeshRefused(f"{path.name} holds no triangle; export a surface")
    mesh = loaded.to_mesh()
    declared = "m" if path.suffix.lower() in _METRES_BY_DEFINITION else _known_unit(loaded.units)
    return RawMesh(np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64), declared)


def _known_unit(declared: str | None) -> str | None:
    """The unit that a file names, or None; COLLADA says how many metres one is."""
    import trimesh

    if declared is None:
        return None
    metres = trimesh.units.unit_conversion(declared, "meters")
    return next((name for name, size in METRES.items() if np.isclose(metres, size, rtol=1e-6)), None)


def _with_meshio(path: Path) -> RawMesh:
    import meshio

    mesh = meshio.read(path)
    faces = [_triangles_of(block.type, np.asarray(block.data, np.int64)) for block in mesh.cells]
    solid = [
        np.asarray(block.data, np.int64)[:, :4] for block in mesh.cells if block.type.startswith("tetra")
    ]
    if solid and not any(len(part) for part in faces):
        faces = [_outside(np.vstack(solid))]
    points = np.zeros((len(mesh.points), 3))
    points[:, : mesh.points.shape[1]] = mesh.points
    return RawMesh(points, np.vstack([np.zeros((0, 3), np.int64), *faces]), None)


def _known_to_meshio(kind: str) -> bool:
    import meshio

    return kind in meshio.extension_to_filetypes


def _triangles_of(kind: str, cells: IntArray) -> IntArray:
    """Faces of surface cells of any order, by their corner nodes; none of other cells."""
    if kind.startswith("triangle"):
        return cells[:, :3]
    if kind.startswith("quad"):
        return np.vstack([cells[:, [0, 1, 2]], cells[:, [0, 2, 3]]])
    return np.zeros((0, 3), np.int64)


def _outside(tetrahedra: IntArray) -> IntArray:
    """Faces that belong to one tetrahedron only."""
    every = tetrahedra[:, _TETRAHEDRON].reshape(-1, 3)
    _, first, count = np.unique(np.sort(every, axis=1), axis=0, return_index=True, return_counts=True)
    outside: IntArray = every[first[count == 1]]
    return outside
