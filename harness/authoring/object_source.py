"""What an ObjectFile is built from: a mesh's origin, and the folder's object."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from harness.basics.code_version import content_hash
from harness.basics.errors import WrongUse
from harness.basics.files.foreign_file import sha256_of
from harness.basics.files.named_file import require_file
from harness.basics.materials import Material
from harness.basics.mesh import Mesh
from harness.objectfile.entries import Provenance, Source
from harness.objectfile.file import MESH, ObjectFile, create_object, file_entry
from harness.objectfile.surface_file import ply_bytes
from harness.objects.builtin import BUILTIN, DESCRIPTION


@dataclass(frozen=True, eq=False)
class PartRequest:
    """What is to be built of an object."""

    mesh: str
    """a file of a surface, with its colours for a look, or of tetrahedra for a sound; or ``builtin:`` and a
    name."""
    material: Material  #: of all of it; only sound asks, an ObjectFile says.
    profile: str = "standard"  #: of the part's profiles.
    units: str | None = None  #: of the file's numbers; None to take the only ones that make sense.
    wall: float | None = None
    """m, of a hollow thing of which the file has the outside; a picture is of the file's faces."""
    licence: str = "unknown"  #: of the mesh, and so of the ObjectFile.
    seed: int = 0  #: of everything random.
    up_axis: str | None = None  #: axis of the file that points up; None for the one that it declares, else z.


def provenance_of(
    wanted: PartRequest,
    part: Literal["audio", "touch", "vision"],
    settings: Mapping[str, str | float | int | bool | None],
    sources: tuple[Source, ...],
) -> Provenance:
    """Return the code, sources, seed and settings that a part was built with."""
    builder = f"harness.authoring.{part}.object_{part}"
    return Provenance(
        code={builder: content_hash(builder)},
        seeds={part: wanted.seed},
        settings={"profile": wanted.profile, **settings},
        sources=sources,
        licence=wanted.licence,
    )


def source_of(mesh: str, licence: str) -> Source:
    """Return the source of a mesh, a file or ``builtin:`` and a name, with the hash of the file.

    Raises:
        WrongUse: there is no such file.
    """
    if mesh.startswith(BUILTIN):
        return Source(what="mesh", origin=mesh, licence=licence)
    path = Path(mesh)
    require_file(path, "file", f"say a mesh file, or {BUILTIN} and a name")
    return Source(what="mesh", origin=path.name, licence=licence, sha256=sha256_of(path))


def created_object(
    origin: str, licence: str, material: Material, mesh: Mesh, out: Path, source: Source
) -> ObjectFile:
    """Open the object in the folder ``out``, or create it if there is none.

    Raises:
        WrongUse: the folder has an object of another mesh or material.
    """
    if not (out / DESCRIPTION).exists():
        name = Path(origin.removeprefix(BUILTIN)).stem
        return create_object(out, name, mesh, material, Provenance(sources=(source,), licence=licence))
    there = ObjectFile.open(out)
    same_mesh = there.description.mesh.sha256 == file_entry(MESH, ply_bytes(mesh)).sha256
    if not same_mesh or there.material != material:
        other = "material" if same_mesh else "mesh"
        raise WrongUse(
            f"{out} holds {there.description.name}, of another {other}; "
            "name another folder, or delete that one"
        )
    return there
