"""The mesh file of every row: named by it, or found in a folder by its name or number."""

from collections.abc import Iterable
from pathlib import Path

from harness.authoring.catalogue.rows import CatalogueRow, ExcludedRow
from harness.objects.builtin import BUILTIN

SUFFIXES = (".obj", ".ply", ".stl", ".off", ".glb", ".gltf", ".3mf", ".msh")
"""Of files that are searched for, in order of preference; a row may name any other that reads."""

_OF_A_FOLDER = ("model", "textured", "nontextured")
"""Names of the mesh in a folder of one object, as ObjectFolder and YCB publish it."""


class MeshFolder:
    """The meshes below a folder by the names that rows may have: its files, and folders of one object each.

    Args:
        folder: is listed once.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        entries = sorted(folder.iterdir()) if folder.is_dir() else []
        self._files = _by_stem(path for path in entries if path.is_file())
        self._folders = {path.name.lower(): path for path in entries if path.is_dir()}

    def find(self, row: CatalogueRow) -> str | None:
        """A mesh's path or ``builtin:`` name; None where there is none."""
        if row.mesh is not None:
            return row.mesh if row.mesh.startswith(BUILTIN) else self._named(row.mesh)
        for name in filter(None, (row.name.lower(), row.number.lower())):
            path = self._files.get(name) or self._in_folder(name)
            if path is not None:
                return str(path)
        return None

    def _named(self, mesh: str) -> str | None:
        path = self.folder / mesh
        return str(path) if path.is_file() else None

    def _in_folder(self, name: str) -> Path | None:
        """The one that is named as usual, or the only one."""
        folder = self._folders.get(name)
        found = (
            {} if folder is None else _by_stem(path for path in sorted(folder.iterdir()) if path.is_file())
        )
        usual = next((found[stem] for stem in (*_OF_A_FOLDER, name) if stem in found), None)
        return usual or (next(iter(found.values())) if len(found) == 1 else None)


def with_meshes(
    rows: Iterable[CatalogueRow], folder: Path
) -> tuple[list[tuple[CatalogueRow, str]], list[ExcludedRow]]:
    """Rows with their meshes, and those without one.

    Args:
        rows: of a catalogue.
        folder: of meshes.
    """
    meshes = MeshFolder(folder)
    found: list[tuple[CatalogueRow, str]] = []
    excluded: list[ExcludedRow] = []
    for row in rows:
        mesh = meshes.find(row)
        if mesh is None:
            wanted = row.mesh or " or ".join(filter(None, (row.name, row.number)))
            reason = f"no mesh {wanted} in {folder}; name its folder with --meshes"
            excluded.append(ExcludedRow(row.name, reason))
        else:
            found.append((row, mesh))
    return found, excluded


def _by_stem(paths: Iterable[Path]) -> dict[str, Path]:
    """Mesh files by their names without suffix, in lower case; of several that of the first suffix."""
    meshes = [path for path in paths if path.suffix.lower() in SUFFIXES]
    meshes.sort(key=lambda path: SUFFIXES.index(path.suffix.lower()), reverse=True)
    return {path.stem.lower(): path for path in meshes}
