"""Where everything of a build lies in its folder."""

import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from pydantic import Field

from harness.authoring.catalogue.rows import ExcludedRow
from harness.basics.errors import CalibrationRefused, WrongUse
from harness.basics.files.json_file import read_model, write_model
from harness.basics.toml_file import StrictModel
from harness.objectfile.entries import FileEntry, Modality
from harness.objects.builtin import DESCRIPTION

Outcome = Literal[
    "built", "refused", "failed", "crashed", "out of time", "out of memory", "disk full", "worker lost"
]
"""``refused`` names the object's own fault, ``failed`` an exception and ``crashed`` a dead process of the
program's making; the others are of the machines."""

PASSING: frozenset[Outcome] = frozenset({"disk full", "worker lost"})
"""Outcomes that are not of the object: the next build tries again."""


@dataclass(frozen=True)
class BuildFolder:
    """The folder of a build."""

    folder: Path  #: that all workers see under the same path.
    shared_stages: Path | None = None
    """folder of stages that several builds share; None for one of this build's own."""

    @property
    def stages(self) -> Path:
        """Results by the hash of what they were computed from."""
        return self.shared_stages or self.folder / "stages"

    @property
    def arrays(self) -> Path:
        """Tetrahedra and modes."""
        return self.stages / "arrays"

    @property
    def aside(self) -> Path:
        """What is being written; on the same file system as ``stages`` and ``folder`` must be."""
        return self.folder / "aside"

    @property
    def lock(self) -> Path:
        """Held by the program that builds."""
        return self.folder / "build.lock"

    @property
    def settings(self) -> Path:
        """The settings of the last build, for status and page."""
        return self.folder / "build.json"

    def stage(self, sense: Modality, key: str) -> Path:
        """The folder of one sense of one object."""
        return self.stages / sense / key[:2] / key

    def object(self, name: str) -> Path:
        """An ObjectFile."""
        return self.folder / "objects" / name

    def record(self, name: str) -> Path:
        """How an object was built."""
        return self.folder / "records" / f"{name}.json"

    def log(self, name: str) -> Path:
        """What programs printed while an object was built."""
        return self.folder / "logs" / f"{name}.txt"

    def failed(self, name: str) -> Path:
        """The record and the log of an object that could not be built."""
        return self.folder / "failed" / name

    def prepare(self) -> None:
        """Make the folders that must be there."""
        for name in ("objects", "records", "logs", "failed", "aside"):
            (self.folder / name).mkdir(parents=True, exist_ok=True)
        self.arrays.mkdir(parents=True, exist_ok=True)


class BuildSettings(StrictModel):
    """The last build of a folder."""

    schema_version: Literal[1] = Field(default=1, alias="schema")  #: of this file.
    catalogue: str  #: path of its file.
    names: tuple[str, ...]  #: of the objects, in the catalogue's order.
    excluded: tuple[ExcludedRow, ...] = ()  #: rows that were not built.


def read_settings(of: BuildFolder) -> BuildSettings:
    """What was noted last.

    Raises:
        WrongUse: nothing was built into the folder.
        CalibrationRefused: the file is damaged.
    """
    advice = "name the --out folder of `touchstone catalogue build`"
    return read_model(of.settings, BuildSettings, "build of a catalogue", advice)


class SenseRecord(StrictModel):
    """One sense of an object."""

    key: str  #: of its stage.
    made: bool  #: whether this build computed it; false where it stood.
    seconds: dict[str, float] = Field(default_factory=dict)
    """on the clock, of each part of the work when it was computed."""
    clock: dict[str, float] = Field(default_factory=dict)
    """what else was measured with a clock, by its name in ``object.json``."""
    remarks: tuple[str, ...] = ()  #: what was done to the mesh and what to look at.


class ObjectRecord(StrictModel):
    """One object."""

    schema_version: Literal[1] = Field(default=1, alias="schema")  #: of this file.
    name: str  #: of the object.
    key: str  #: of all that it depends on.
    outcome: Outcome  #: what became of it.
    reason: str = ""  #: where it was not built.
    seconds: float = 0.0  #: s on the clock of the last attempt.
    attempts: int = 1  #: that it took.
    host: str = ""  #: that built it.
    senses: dict[Modality, SenseRecord] = Field(default_factory=dict)  #: by name.
    object_json_bytes: int = 0  #: size of the description; 0 where it was not built.
    object_json_sha256: str = ""  #: hash of the description; "" where it was not built.
    files: tuple[FileEntry, ...] = ()  #: that the description names.

    @property
    def built(self) -> bool:
        """Whether there is an ObjectFile."""
        return self.outcome == "built"


def write_record(record: ObjectRecord, of: BuildFolder) -> None:
    """Keep a record: of a built object among the records, of another one with its log in ``failed``.

    Raises:
        OSError: the disk is full.
    """
    apart = of.failed(record.name)
    if record.built:
        write_model(record, of.record(record.name))
        shutil.rmtree(apart, ignore_errors=True)
        return
    apart.mkdir(parents=True, exist_ok=True)
    if of.log(record.name).is_file():
        shutil.copyfile(of.log(record.name), apart / "log.txt")
    write_model(record, apart / "record.json")


def read_record(of: BuildFolder, name: str) -> ObjectRecord | None:
    """The record of the last attempt; None where there is none that reads."""
    return _read(of.failed(name) / "record.json") or _read(of.record(name))


def stands(of: BuildFolder, record: ObjectRecord | None, key: str) -> bool:
    """Whether an object was built from just this and its files are there, by name and size."""
    if record is None or not record.built or record.key != key:
        return False
    folder = of.object(record.name)
    sizes = {DESCRIPTION: record.object_json_bytes, **{entry.file: entry.bytes for entry in record.files}}
    return all(_size(folder / name) == size for name, size in sizes.items())


def _size(path: Path) -> int | None:
    try:
        return path.stat().st_size
    except OSError:
        return None


def _read(path: Path) -> ObjectRecord | None:
    try:
        return read_model(path, ObjectRecord, "record of a build", "delete it and build again")
    except (WrongUse, CalibrationRefused):
        return None
