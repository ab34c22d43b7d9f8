"""An ObjectFile as the object of a scene: its folder stands for mesh, name and material.

Those that come with the program lie in ``objects/`` of the checkout, beside scenes and stations, and are
found by their names alone, as stations are.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from harness.basics.errors import DataRefused, WrongUse
from harness.basics.files.named_file import real_path
from harness.bench.named_files import shipped_or_here
from harness.objects.builtin import DESCRIPTION

OBJECTFILE = "objectfile:"
"""In place of a mesh file: the object is that of the folder beside it, whose name follows."""

_OF_A_MESH = ("material", "units", "wall")


def holds_objectfile(folder: Path) -> bool:
    """Whether a path is the folder of an ObjectFile."""
    return (folder / DESCRIPTION).is_file()


def shipped_objectfiles() -> dict[str, Path]:
    """Folders of the ObjectFiles in ``objects/``, here or in the checkout, by their names."""
    return {path.name: path.resolve() for path in shipped_or_here("objects", "*") if holds_objectfile(path)}


def objectfile_folder(named: str, beside: Path) -> Path:
    """The folder that a text means: a path, or the name of an ObjectFile in ``objects/``.

    Args:
        named: what is at that path comes before what has that name.
        beside: the folder that a path is relative to.
    """
    path = real_path(beside / named)
    return path if path.exists() else shipped_objectfiles().get(named, path)


def require_objectfile(folder: Path, where: str) -> None:
    """Refuse a folder that is none; ``WrongUse`` says where it was named."""
    if not holds_objectfile(folder):
        make = "make one with `touchstone object build`, or leave the key out"
        own = (
            f"those that come with the program have the names {', '.join(shipped_objectfiles()) or '(none)'}"
        )
        kind = f"ObjectFile {folder}, a folder with {DESCRIPTION} in it"
        raise WrongUse(f"{where}: 'object.objectfile': there is no {kind}; {own}; {make}")


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
    require_objectfile(path, where)
    name, material = _described(path / DESCRIPTION)
    return {**tree, "object": {**named, "mesh": OBJECTFILE + name, "material": material}}


def _described(path: Path) -> tuple[str, str]:
    """Name and material; whoever opens the folder reads all of it, and strictly."""
    try:
        tree = json.loads(path.read_text(encoding="utf-8"))
        return str(tree["name"]), str(tree["material"]["name"])
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise DataRefused(
            f"{path} does not say the object's name and material; copy it again, or build the object again"
        ) from error
