"""A folder with networks imported from a published file: ``object.json`` of its own kind, and its files."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from harness.basics.errors import WrongUse
from harness.objectfile.description import is_published, model_from, read_tree
from harness.objectfile.entries import FileEntry
from harness.objectfile.file import read_named, write_described
from harness.objectfile.published.entries import PublishedDescription
from harness.objects.builtin import DESCRIPTION


@dataclass(frozen=True, eq=False)
class PublishedObject:
    """An object whose networks were published by others."""

    folder: Path  #: it lies in.
    description: PublishedDescription  #: what its ``object.json`` says.

    @classmethod
    def open(cls, folder: Path) -> "PublishedObject":
        """Read ``object.json``; the files are read when they are used.

        Raises:
            WrongUse: there is none, or it is of an object built from its mesh.
            DataRefused: it is damaged.
        """
        path = folder / DESCRIPTION
        tree = read_tree(path)
        if not is_published(tree):
            raise WrongUse(
                f"{folder} was built from a mesh and not imported from a published file; open it as an "
                "ObjectFile"
            )
        return cls(folder, model_from(tree, PublishedDescription, str(path)))

    def read(self, entry: FileEntry) -> bytes:
        """A file's bytes, which are those that were written.

        Raises:
            DataRefused: it is missing, leads out of the folder, or its size or hash differs.
        """
        return read_named(self.folder, entry)


def holds_published(folder: Path) -> bool:
    """Whether a folder's ``object.json`` is of imported networks.

    Raises:
        WrongUse: there is none.
        DataRefused: it is no JSON.
    """
    return is_published(read_tree(folder / DESCRIPTION))


def create_published(folder: Path, tree: Mapping[str, Any], contents: Mapping[str, bytes]) -> PublishedObject:
    """A new folder of imported networks.

    Args:
        folder: made where it is not there.
        tree: ``object.json``, without ``schema`` and ``kind``.
        contents: bytes of every file that it names, by name.

    Raises:
        WrongUse: the folder holds an object already.
        DataRefused: the description does not hold together.
    """
    if (folder / DESCRIPTION).exists():
        raise WrongUse(f"{folder} holds an object already; name another folder, or delete that one")
    described = {"schema": 1, "kind": "published", **tree}
    description = model_from(described, PublishedDescription, str(folder / DESCRIPTION))
    folder.mkdir(parents=True, exist_ok=True)
    write_described(folder, description, contents)
    return PublishedObject(folder, description)
