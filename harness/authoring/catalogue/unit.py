"""The unit of work: one object under one spec becomes one folder, whole or not at all."""

import errno
import os
import shutil
import socket
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from harness.authoring.audio.object_audio import AudioRequest, BuiltAudio, build_audio
from harness.authoring.catalogue.findings import units_of
from harness.authoring.catalogue.layout import BuildFolder, ObjectRecord, Outcome, SenseRecord, write_record
from harness.authoring.catalogue.spec import BuildItem, BuildSpec, build_item
from harness.authoring.object_source import PartRequest
from harness.authoring.touch.object_touch import BuiltTouch, TouchRequest, build_touch
from harness.authoring.training import Report
from harness.authoring.vision.object_vision import BuiltVision, build_vision
from harness.basics.errors import DataRefused, MeshRefused, TouchstoneError
from harness.basics.files.json_file import read_model, write_model
from harness.basics.files.lock_file import release_lock, take_lock
from harness.basics.materials import MATERIALS
from harness.basics.store import Store
from harness.basics.whole_file import sync_folder
from harness.objectfile.description import Description, description_from, description_text
from harness.objectfile.entries import MaterialEntry, Modality
from harness.objectfile.file import ObjectFile, file_entry, write_described
from harness.objects.builtin import DESCRIPTION

_NO_SPACE = (errno.ENOSPC, errno.EDQUOT)

STAGE = "stage.json"
"""In a stage's folder: its ``SenseRecord``."""

_CLOCK = "seconds"
"""How the names of numbers begin that a clock measured."""


def build_object(item: BuildItem, spec: BuildSpec, of: BuildFolder, report: Report) -> ObjectRecord:
    """Build an object from its stages, those that are missing first; its record is on the disk too.

    A named failure is an outcome, not an exception: it is recorded, and other objects are built.
    """
    begun = time.perf_counter()
    try:
        if build_item(item.row, item.mesh, spec).key != item.key:
            raise DataRefused(
                f"{item.mesh} or the program on {socket.gethostname()} is not the one that the build was "
                "planned with; install one version everywhere, leave meshes alone meanwhile, and build again"
            )
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


@dataclass(frozen=True, eq=False)
class SenseStage:
    """A sense that is on the disk."""

    object: ObjectFile  #: an ObjectFile with this sense alone.
    record: SenseRecord  #: how it came about; ``made`` where it was built just now.


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
            target = aside / entry.file
            try:
                os.link(source, target)
            except OSError:
                shutil.copyfile(source, target)
        write_described(aside, description, {})
        aside.chmod(0o755)
        folder = of.object(name)
        if folder.is_dir():
            # Killed between the two renames, the object is missing, and composed again from its stages.
            old = aside.with_name(f"{aside.name}.old")
            folder.rename(old)
            aside.rename(folder)
            shutil.rmtree(old, ignore_errors=True)
        else:
            aside.rename(folder)
        sync_folder(folder.parent)
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def sense_stage(
    sense: Modality, item: BuildItem, spec: BuildSpec, of: BuildFolder, report: Report
) -> SenseStage:
    """Build a sense, or find it built.

    The folder is a pure function of its key: numbers that a clock measured are in the record alone.

    Raises:
        WrongUse: options that cannot be.
        DataRefused: a mesh that cannot stand for an object.
        OSError: the disk is full.
    """
    folder = of.stage(sense, item.stages[sense])
    made = not folder.is_dir()
    if made:
        with _workspace(of, f"{sense}-{item.stages[sense]}") as aside:
            built = _build(sense, item, spec, Store(of.arrays), aside, report)
            clock = _without_clock(aside)
            record = SenseRecord(
                key=item.stages[sense],
                made=False,
                seconds=dict(built.seconds),
                clock=clock,
                remarks=built.said,
            )
            write_model(record, aside / STAGE)
            commit_folder(aside, folder)
            report(f"{sense} is made", 1.0)
    record = read_model(folder / STAGE, SenseRecord, "record of a stage", "delete its folder and build again")
    return SenseStage(ObjectFile.open(folder), record.model_copy(update={"made": made}))


def commit_folder(aside: Path, folder: Path) -> None:
    """Move a whole folder to its place; where another process was first, its folder stays.

    Raises:
        OSError: the disk is full, or the two are on different file systems.
    """
    folder.parent.mkdir(parents=True, exist_ok=True)
    try:
        aside.rename(folder)
    except OSError:
        if not folder.is_dir():
            raise
        shutil.rmtree(aside, ignore_errors=True)
    sync_folder(folder.parent)


@contextmanager
def _workspace(of: BuildFolder, name: str) -> Iterator[Path]:
    """A folder to write in: the one of an attempt that was killed, whose training goes on, or a new one.

    It is on the file system of the stages, so that it can be renamed. An attempt that fails leaves nothing: a
    full disk needs the space.
    """
    parent = of.stages / "aside"
    parent.mkdir(parents=True, exist_ok=True)
    lock = parent / f"{name}.lock"
    held = take_lock(lock)
    if held is None:  # a worker that was given up is still writing there
        folder = Path(tempfile.mkdtemp(prefix=f"{name}-", dir=parent))
    else:
        folder = parent / name
        folder.mkdir(exist_ok=True)
    try:
        yield folder
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    finally:
        if held is not None:
            release_lock(lock, held)


def _build(
    sense: Modality, item: BuildItem, spec: BuildSpec, store: Store, out: Path, report: Report
) -> BuiltAudio | BuiltTouch | BuiltVision:
    row = item.row
    wanted = PartRequest(
        mesh=item.mesh,
        material=MATERIALS[row.material],
        profile=spec.profile,
        units=units_of(row, item.mesh),
        wall=row.wall,
        licence=row.licence,
        seed=spec.seed,
        up_axis=row.up_axis,
    )
    if sense == "audio":
        own = AudioRequest(**vars(wanted), limit=spec.limit, most=spec.most, edge=spec.edge)
        return build_audio(own, out, store, report, threads=1)
    if sense == "touch":
        return build_touch(TouchRequest(**vars(wanted), sensor=spec.sensor), out, report, threads=1)
    return build_vision(wanted, out, report, threads=1)


def _without_clock(folder: Path) -> dict[str, float]:
    """Take out of ``object.json`` what a clock measured, which differs each time; it by its places."""
    of = ObjectFile.open(folder)
    tree = of.description.model_dump(mode="json", by_alias=True)
    clock: dict[str, float] = {}
    _strip(tree, "", clock)
    write_described(folder, description_from(tree, str(folder / DESCRIPTION)), {})
    return clock


def _strip(tree: Any, where: str, clock: dict[str, float]) -> None:
    if isinstance(tree, list):
        for index, item in enumerate(tree):
            _strip(item, f"{where}{index}.", clock)
    if not isinstance(tree, dict):
        return
    for name in list(tree):
        if name in ("seconds", "cpu_seconds"):
            clock |= {f"{where}{name}.{part}": took for part, took in tree[name].items()}
            tree[name] = {}
        elif name.startswith(_CLOCK) and isinstance(tree[name], float):
            clock[f"{where}{name}"] = tree.pop(name)
        else:
            _strip(tree[name], f"{where}{name}.", clock)
