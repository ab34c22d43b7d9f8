"""The unit of work: one object under one spec becomes one folder, whole or not at all."""

import errno
import shutil
import socket
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from harness.authoring.catalogue.layout import BuildFolder
from harness.authoring.catalogue.record import ObjectRecord, Outcome, write_record
from harness.authoring.catalogue.spec import BuildItem, BuildSpec, build_item
from harness.authoring.catalogue.stages import SenseStage, link_or_copy, sense_stage
from harness.authoring.training import Report
from harness.basics.errors import DataRefused, MeshRefused, TouchstoneError
from harness.basics.materials import MATERIALS
from harness.basics.whole_file import sync_folder
from harness.objectfile.description import Description, description_from, description_text
from harness.objectfile.entries import MaterialEntry
from harness.objectfile.file import file_entry, write_described

_NO_SPACE = (errno.ENOSPC, errno.EDQUOT)


def build_object(item: BuildItem, spec: BuildSpec, of: BuildFolder, report: Report) -> ObjectRecord:
    """Build an object from its stages, those that are missing first; its record is on the disk too.

    A named failure is an outcome, not an exception: it is recorded, and other objects go on.

    Args:
        item: the object.
        spec: what is built.
        of: the build's folder.
        report: takes progress.
    """
    begun = time.perf_counter()
    try:
        _check_key(item, spec)
        stages = [sense_stage(sense, item, spec, of, report) for sense in item.stages]
        description = _composed(item, stages)
        _place(description, stages, of, item.row.name)
    except (TouchstoneError, MemoryError, OSError) as error:
        return _recorded(failure(item, *_named(error), time.perf_counter() - begun), of)
    text = file_entry("description", description_text(description).encode())
    return _recorded(
        ObjectRecord(
            name=item.row.name,
            key=item.key,
            outcome="built",
            seconds=time.perf_counter() - begun,
            host=socket.gethostname(),
            senses={sense: stage.record for sense, stage in zip(item.stages, stages, strict=True)},
            object_json_bytes=text.bytes,
            object_json_sha256=text.sha256,
            files=description.files,
        ),
        of,
    )


def _check_key(item: BuildItem, spec: BuildSpec) -> None:
    """Refuse to build something else than was planned.

    Raises:
        DataRefused: the mesh was changed since, or this machine has another program or another file.
    """
    if build_item(item.row, item.mesh, spec).key != item.key:
        raise DataRefused(
            f"{item.mesh} or the program on {socket.gethostname()} is not the one that the build was planned "
            "with; install one version everywhere, leave meshes alone meanwhile, and build again"
        )


def failure(item: BuildItem, outcome: Outcome, reason: str, seconds: float) -> ObjectRecord:
    """The record of an object that was not built."""
    return ObjectRecord(
        name=item.row.name,
        key=item.key,
        outcome=outcome,
        reason=reason,
        seconds=seconds,
        host=socket.gethostname(),
    )


def _recorded(record: ObjectRecord, of: BuildFolder) -> ObjectRecord:
    """The record, once it is on the disk; a disk that is full takes no record, which is an outcome too."""
    try:
        write_record(record, of)
    except OSError as error:
        if error.errno not in _NO_SPACE:
            raise
        return record.model_copy(update={"outcome": "disk full", "reason": _space(error, of.folder)})
    return record


def _named(error: Exception) -> tuple[Outcome, str]:
    if isinstance(error, MemoryError):
        return (
            "out of memory",
            "the worker's memory was used up; allow more with --memory, or fewer --workers",
        )
    if isinstance(error, OSError):
        if error.errno in _NO_SPACE:
            return "disk full", _space(error, Path(str(error.filename or ".")))
        return "failed", f"{error.filename or 'a file'}: {error.strerror or error}"
    return "refused", str(error)


def _space(error: OSError, path: Path) -> str:
    where = error.filename or path
    return f"{where}: {error.strerror or 'no space left'}; free space on that disk and build again"


def _composed(item: BuildItem, stages: Sequence[SenseStage]) -> Description:
    """One description of all senses, under the row's name and material."""
    trees = [stage.object.description.model_dump(mode="json", by_alias=True) for stage in stages]
    meshes = {stage.object.description.mesh.sha256 for stage in stages}
    if len(meshes) > 1:
        raise MeshRefused(
            f"{item.mesh} is another surface to sound than to touch and look, as a file of tetrahedra is; "
            "build its sound alone (--senses audio), or give its surface"
        )
    tree = trees[0]
    for sense, own in zip(item.stages, trees, strict=True):
        tree[sense] = own[sense]
    tree["name"] = item.row.name
    tree["material"] = MaterialEntry.of(MATERIALS[item.row.material]).model_dump(mode="json")
    return description_from(tree, f"the description of {item.row.name}")


def _place(description: Description, stages: Sequence[SenseStage], of: BuildFolder, name: str) -> None:
    """Write the folder aside and move it to its place; an older one of that name gives way."""
    aside = Path(tempfile.mkdtemp(prefix=f"{name}-", dir=of.aside))
    try:
        for entry in description.files:
            source = next(
                each.object.folder / entry.file for each in stages if entry in each.object.description.files
            )
            link_or_copy(source, aside / entry.file)
        write_described(aside, description, {})
        aside.chmod(0o755)
        _exchange(aside, of.object(name))
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def _exchange(aside: Path, folder: Path) -> None:
    if folder.is_dir():
        # Killed between the two renames, the object is missing, and composed again from its stages.
        old = aside.with_name(f"{aside.name}.old")
        folder.rename(old)
        aside.rename(folder)
        shutil.rmtree(old, ignore_errors=True)
    else:
        aside.rename(folder)
    sync_folder(folder.parent)
