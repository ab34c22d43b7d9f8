"""An ObjectFile on disk: a folder with ``object.json`` and the files that it names.

Files are read on first use, each against its hash. Reading runs nothing of what is read.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from harness.basics.errors import DataRefused, WrongUse
from harness.basics.files.named_file import real_path
from harness.basics.materials import Material
from harness.basics.mesh import Mesh
from harness.basics.whole_file import write_bytes_whole
from harness.objectfile.description import (
    SCHEMA,
    Description,
    description_from,
    description_text,
    read_description,
)
from harness.objectfile.entries import (
    AudioEntry,
    Entry,
    FileEntry,
    MaterialEntry,
    MeshEntry,
    Modality,
    Provenance,
)
from harness.objectfile.surface_file import mesh_from_ply, ply_bytes
from harness.objectfile.touch_entries import TouchEntry
from harness.objectfile.vision_entry import VisionEntry
from harness.objects.builtin import DESCRIPTION

MESH = "mesh.ply"


@dataclass(frozen=True, eq=False)
class ObjectFile:
    """What is known of one object."""

    folder: Path  #: it lies in.
    description: Description  #: what its ``object.json`` says.

    @classmethod
    def open(cls, folder: Path) -> "ObjectFile":
        """Read ``object.json``; the files are read when they are used.

        Raises:
            DataRefused: it is missing or damaged; what is wrong is named.
        """
        return cls(folder, read_description(folder / DESCRIPTION))

    @cached_property
    def content_key(self) -> str:
        """A hash of all contents of the folder, as ``object.json`` has the hash of every file."""
        return hashlib.sha256(description_text(self.description).encode()).hexdigest()

    @cached_property
    def mesh(self) -> Mesh:
        """The object's surface, in metres.

        Raises:
            DataRefused: the file is not the one described.
        """
        entry = self.description.mesh
        return mesh_from_ply(self.read(entry), entry.file, entry.metres_per_unit)

    @property
    def material(self) -> Material:
        """As the modes were computed with."""
        return self.description.material.material()

    def read(self, entry: FileEntry) -> bytes:
        """A file's bytes, which are those that were written.

        Raises:
            DataRefused: it is missing, leads out of the folder, or its size or hash differs.
        """
        return read_named(self.folder, entry)


def read_named(folder: Path, entry: FileEntry) -> bytes:
    """The bytes of a file that a folder's ``object.json`` names; as ``ObjectFile.read``."""
    path = folder / entry.file
    if not path.is_file():
        raise DataRefused(f"{path} is missing; copy the whole folder again, or build the object again")
    if real_path(path).parent != real_path(folder):
        raise DataRefused(f"{path} leads out of its folder, to {real_path(path)}; put the file itself there")
    size = path.stat().st_size
    if size != entry.bytes:
        raise DataRefused(
            f"{path} has {size} bytes where object.json says {entry.bytes}; "
            "copy it again, or build the object again"
        )
    data = path.read_bytes()
    found = hashlib.sha256(data).hexdigest()
    if found != entry.sha256:
        raise DataRefused(
            f"{path} was changed: its sha256 is {found[:12]}... where object.json says "
            f"{entry.sha256[:12]}...; copy it again, or build the object again"
        )
    return data


def file_entry(name: str, data: bytes) -> FileEntry:
    """What ``object.json`` says of a file with these bytes."""
    return FileEntry(file=name, sha256=hashlib.sha256(data).hexdigest(), bytes=len(data))


def create_object(
    folder: Path, name: str, mesh: Mesh, material: Material, provenance: Provenance
) -> ObjectFile:
    """Create an ObjectFile without any modality from a mesh in metres and the mesh's provenance.

    Raises:
        WrongUse: the folder already has an ObjectFile.
    """
    if (folder / DESCRIPTION).exists():
        raise WrongUse(f"{folder} holds an ObjectFile already; open it, or name another folder")
    folder.mkdir(parents=True, exist_ok=True)
    data = ply_bytes(mesh)
    low, high = mesh.bounds.tolist()
    entry = MeshEntry(
        **file_entry(MESH, data).model_dump(),
        metres_per_unit=1.0,
        vertices=len(mesh.vertices),
        faces=len(mesh.faces),
        low_m=tuple(low),
        high_m=tuple(high),
    )
    described: dict[str, Any] = {
        "schema": SCHEMA,
        "name": name,
        "material": MaterialEntry.of(material).model_dump(mode="json"),
        "mesh": entry.model_dump(mode="json"),
        "provenance": provenance.model_dump(mode="json"),
    }
    description = description_from(described, str(folder / DESCRIPTION))
    write_described(folder, description, {MESH: data})
    return ObjectFile(folder, description)


def with_part(
    of: ObjectFile,
    modality: Modality,
    entry: AudioEntry | TouchEntry | VisionEntry,
    contents: Mapping[str, bytes],
) -> ObjectFile:
    """Write a modality into an ObjectFile, replacing an earlier version; see ``write_described``.

    ``contents`` holds the bytes of every file that the entry names, by name.

    Raises:
        DataRefused: the entry does not describe the contents.
    """
    tree = of.description.model_dump(mode="json", by_alias=True)
    tree[modality] = entry.model_dump(mode="json")
    description = description_from(tree, str(of.folder / DESCRIPTION))
    before = of.description.files
    for file in description.files:
        data = contents.get(file.file)
        if data is None and file not in before:
            raise DataRefused(f"{modality} names {file.file!r}, of which no bytes were given")
        if data is not None and file_entry(file.file, data).sha256 != file.sha256:
            raise DataRefused(f"{modality} names another {file.file!r} than the bytes that were given")
    unnamed = sorted(set(contents) - {file.file for file in description.files})
    if unnamed:
        raise DataRefused(f"{modality} does not name {unnamed}; it would never be read")
    write_described(of.folder, description, contents)
    return ObjectFile(of.folder, description)


def write_described(folder: Path, description: Entry, contents: Mapping[str, bytes]) -> None:
    """Write files and then ``object.json``: readers see the old object, the new one, or a refusal."""
    for name, data in contents.items():
        write_bytes_whole(folder / name, data)
    write_bytes_whole(folder / DESCRIPTION, description_text(description).encode())
