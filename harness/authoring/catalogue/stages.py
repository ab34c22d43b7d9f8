"""One sense of one object, built once: a folder found by the hash of all that it depends on."""

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from harness.authoring.audio.object_audio import AudioRequest, BuiltAudio, build_audio
from harness.authoring.catalogue.findings import units_of
from harness.authoring.catalogue.layout import BuildFolder
from harness.authoring.catalogue.record import SenseRecord
from harness.authoring.catalogue.spec import BuildItem, BuildSpec
from harness.authoring.object_source import PartRequest
from harness.authoring.touch.object_touch import BuiltTouch, TouchRequest, build_touch
from harness.authoring.training import Report
from harness.authoring.vision.object_vision import BuiltVision, build_vision
from harness.basics.files.json_file import read_model, write_model
from harness.basics.files.lock_file import release_lock, take_lock
from harness.basics.materials import MATERIALS
from harness.basics.store import Store
from harness.basics.whole_file import sync_folder
from harness.objectfile.description import description_from
from harness.objectfile.entries import Modality
from harness.objectfile.file import ObjectFile, write_described
from harness.objects.builtin import DESCRIPTION

STAGE = "stage.json"
"""In a stage's folder: its ``SenseRecord``."""

_CLOCK = "seconds"
"""How the names of numbers begin that a clock measured."""


@dataclass(frozen=True, eq=False)
class SenseStage:
    """A sense that is on the disk.

    Attributes:
        object: an ObjectFile with this sense alone.
        record: how it came about; ``made`` where it was built just now.
    """

    object: ObjectFile
    record: SenseRecord


def sense_stage(
    sense: Modality, item: BuildItem, spec: BuildSpec, of: BuildFolder, report: Report
) -> SenseStage:
    """Build a sense, or find it built.

    The folder is a pure function of its key: numbers that a clock measured are in the record alone.

    Args:
        sense: one of the spec's.
        item: the object.
        spec: what is built.
        of: the build's folder.
        report: takes progress.

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


def _request(item: BuildItem, spec: BuildSpec) -> PartRequest:
    row = item.row
    return PartRequest(
        mesh=item.mesh,
        material=MATERIALS[row.material],
        profile=spec.profile,
        units=units_of(row, item.mesh),
        wall=row.wall,
        licence=row.licence,
        seed=spec.seed,
        up_axis=row.up_axis,
    )


def _build(
    sense: Modality, item: BuildItem, spec: BuildSpec, store: Store, out: Path, report: Report
) -> BuiltAudio | BuiltTouch | BuiltVision:
    wanted = _request(item, spec)
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


def link_or_copy(source: Path, target: Path) -> None:
    """One file under two names where the file system can, else a copy."""
    try:
        os.link(source, target)
    except OSError:
        shutil.copyfile(source, target)
