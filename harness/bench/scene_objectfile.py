"""An ObjectFile as the object of a scene: its folder stands for mesh, name and material.

Those that come with the program, and those in ``objects/`` of the working directory, are found by their
names alone, as stations are.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from harness.basics.errors import DataRefused, WrongUse
from harness.basics.files.named_file import nearest, real_path
from harness.bench.named_files import known_files, name_in
from harness.objects.builtin import BUILTIN, DESCRIPTION, MATERIALS

OBJECTFILE = "objectfile:"
"""In place of a mesh file: the object is that of the folder beside it, whose name follows."""

_OF_A_MESH = ("material", "units", "wall", "up_axis")


def holds_objectfile(folder: Path) -> bool:
    """Whether a path is the folder of an ObjectFile."""
    return (folder / DESCRIPTION).is_file()


def shipped_objectfiles() -> dict[str, Path]:
    """Return the folders of the ObjectFiles in ``objects/``, here or shipped, by their names."""
    return {name: path for name, path in known_files("objects", "*").items() if holds_objectfile(path)}


def objectfile_folder(named: str, beside: Path) -> Path:
    """Find the folder of an ObjectFile by its path, its name, or ``objects/NAME``.

    Args:
        named: what is at that path comes before what has that name.
        beside: the folder that a path is relative to.
    """
    path = real_path(beside / named)
    if path.exists():
        return path
    return shipped_objectfiles().get(name_in(Path(named), "objects") or named, path)


def require_object(named: str, beside: Path, where: str, objectfiles: bool = True) -> None:
    """Refuse an object that does not exist.

    Args:
        named: ``"builtin:mug"``, the path of a mesh file, or an ObjectFile: its folder or its name.
        beside: the folder that a path is relative to.
        where: option or key that names the object, for the message.
        objectfiles: whether an ObjectFile is accepted.

    Raises:
        WrongUse: there is none; the nearest known name is suggested.
    """
    if named.startswith(BUILTIN):
        name = named.removeprefix(BUILTIN)
        if name not in MATERIALS:
            raise WrongUse(f"{where}: there is no built-in object {name!r}; {nearest(name, MATERIALS)}")
        return
    path = objectfile_folder(named, beside) if objectfiles else real_path(beside / named)
    if path.is_file() or (objectfiles and holds_objectfile(path)):
        return
    if path.is_dir():
        accepted = f"a mesh file, or a folder with {DESCRIPTION} in it" if objectfiles else "a mesh file"
        raise WrongUse(f"{where}: {path} is a folder; give {accepted}")
    known = [f"{BUILTIN}{name}" for name in MATERIALS] + (list(shipped_objectfiles()) if objectfiles else [])
    raise WrongUse(f"{where}: there is no file {path} and no object of this name; {nearest(named, known)}")


def require_objectfile(folder: Path, where: str) -> None:
    """Refuse a path that is not the folder of an ObjectFile.

    Args:
        folder: as ``objectfile_folder`` returns it.
        where: option or key that names the folder, for the message.

    Raises:
        WrongUse: there is no such folder, or no ``object.json`` in it.
    """
    if holds_objectfile(folder):
        return
    own = f"give a folder with {DESCRIPTION} in it, or make one with `touchstone object build`"
    if folder.exists():
        raise WrongUse(f"{where}: {folder} is no ObjectFile: there is no {DESCRIPTION} in it; {own}")
    raise WrongUse(
        f"{where}: there is no ObjectFile {folder}; {nearest(folder.name, shipped_objectfiles())}; or {own}"
    )


def find_objectfile(named: str | Path, where: str = "object") -> Path:
    """Find the folder of an ObjectFile by its path, its name, or ``objects/NAME``, from any folder.

    Args:
        named: path or name.
        where: option or argument that names it, for the message.

    Raises:
        WrongUse: there is none; the nearest known name is suggested.
    """
    folder = objectfile_folder(str(named), Path())
    require_objectfile(folder, where)
    return folder


def with_objectfile(tree: Any, folder: Path, where: str) -> Any:
    """The tree of a scene whose object is an ObjectFile, with its name and material; any other as it is.

    Args:
        tree: as a file or options have it.
        folder: that paths in it are relative to.
        where: it comes from, for messages.

    Raises:
        WrongUse: there is no such ObjectFile, or a key beside it that only a mesh has.
        DataRefused: its description is damaged.
    """
    named = tree.get("object") if isinstance(tree, Mapping) else None
    if not isinstance(named, Mapping) or "mesh" in named or not isinstance(named.get("objectfile"), str):
        return tree
    path = objectfile_folder(named["objectfile"], folder)
    for key in _OF_A_MESH:
        if key in named:
            raise WrongUse(
                f"{where}: 'object.{key}' is of a mesh, and the ObjectFile {path} says its own; leave it out"
            )
    require_objectfile(path, f"{where}: 'object.objectfile'")
    # Only name and material: the program that opens the folder reads all of it, and strictly.
    description = path / DESCRIPTION
    try:
        described = json.loads(description.read_text(encoding="utf-8"))
        name, material = str(described["name"]), str(described["material"]["name"])
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise DataRefused(
            f"{description} does not say the object's name and material; copy it again, or build the object "
            "again"
        ) from error
    return {**tree, "object": {**named, "mesh": OBJECTFILE + name, "material": material}}
