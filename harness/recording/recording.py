"""A run is a folder: what was asked, what was read, and nothing an estimate does not need.

``run.json`` says what the run is; ``steps/NNN.mcap`` hold the readings. A step is on disk
whole or not at all, and the first step that is not is where a run resumes.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from harness.basics.errors import RecordingDamaged, WrongUse
from harness.basics.whole_file import make_folder, write_text_whole
from harness.bench.reading import Reading
from harness.recording.checksums import SUM, sum_of_values
from harness.recording.step_file import Step, StepRecord, read_step, write_step

SCHEMA = 2
_UNSUMMED = 1
"""The schema of runs whose files carry no checksums; they are read as they are."""


@dataclass(frozen=True)
class RunHeader:
    """What a run is, written once before anything moves.

    Attributes:
        experiment: its name on the command line.
        scene: the resolved scene, as JSON values.
        station: the resolved station, as JSON values.
        plan: the steps that were planned, and how, as JSON values.
        files: content hashes of the files copied into the folder, by name.
        versions: of the project, its git commit and the libraries that shape numbers.
        seed: of everything random in the run.
        mock: how the mocked bench was started; None at a real bench.
        clock_offset_ns: wall clock minus bench clock.
        created: wall time, ISO 8601.
        schema: of this file.
    """

    experiment: str
    scene: Mapping[str, Any]
    station: Mapping[str, Any]
    plan: Mapping[str, Any]
    files: Mapping[str, str]
    versions: Mapping[str, str]
    seed: int
    mock: Mapping[str, Any] | None
    clock_offset_ns: int
    created: str
    schema: int = field(default=SCHEMA)


class Recording:
    """A run folder, open for reading and for committing further steps."""

    def __init__(self, folder: Path) -> None:
        """Open an existing run; ``RecordingDamaged`` or ``WrongUse`` where it is none."""
        self.folder = folder
        self.header = _read_header(folder / "run.json")

    @classmethod
    def create(cls, folder: Path, header: RunHeader) -> "Recording":
        """Make the folder and its ``run.json``; refuses a folder that holds a run already."""
        require_unused(folder)
        make_folder(folder / "steps")
        fields = json.loads(json.dumps(asdict(header), allow_nan=False))
        summed = {**fields, SUM: sum_of_values(fields)}
        write_text_whole(folder / "run.json", json.dumps(summed, indent=1, allow_nan=False))
        return cls(folder)

    @property
    def truth_path(self) -> Path:
        """Where a mock world writes what is true: beside the run, where no estimate looks."""
        return self.folder.with_name(self.folder.name + ".truth.json")

    def planned(self, key: str) -> list[Mapping[str, Any]]:
        """The steps that ``run.json`` plans under a key; ``RecordingDamaged`` where it plans none there."""
        steps = self.header.plan.get(key)
        if not isinstance(steps, list) or not all(isinstance(step, dict) for step in steps):
            raise RecordingDamaged(f"{self.folder / 'run.json'} plans no {key!r}; {_COPY}")
        return steps

    @property
    def committed(self) -> int:
        """How many steps are on disk; ``RecordingDamaged`` where one is missing in between."""
        found = sorted(int(path.stem) for path in (self.folder / "steps").glob("[0-9]*.mcap"))
        if found != list(range(len(found))):
            missing = sorted(set(range(len(found))) - set(found))
            raise RecordingDamaged(f"{self.folder}: step {missing[0]} is missing but later steps are there")
        return len(found)

    def commit(self, step: Step, readings: Sequence[Reading], seconds: float) -> None:
        """Put a performed step on the disk, whole."""
        if step.index != self.committed:
            raise ValueError(f"step {step.index} cannot follow {self.committed} committed steps")
        by_name = {reading.channel.name: reading for reading in readings}
        write_step(self._path(step.index), StepRecord(step, by_name, seconds), self.header.clock_offset_ns)

    def step(self, index: int) -> StepRecord:
        """Step ``index`` as it was performed."""
        summed = self.header.schema != _UNSUMMED
        record = read_step(self._path(index), self.header.clock_offset_ns, summed)
        if record.step.index != index:
            raise RecordingDamaged(f"{self._path(index)} says it is step {record.step.index}")
        return record

    def steps(self) -> list[StepRecord]:
        """Every committed step in order."""
        return [self.step(index) for index in range(self.committed)]

    def _path(self, index: int) -> Path:
        return self.folder / "steps" / f"{index:03d}.mcap"


def require_unused(folder: Path) -> None:
    """Refuse a folder that holds a run, before anything in it is touched."""
    if (folder / "run.json").exists() or any((folder / "steps").glob("[0-9]*.mcap")):
        raise WrongUse(f"{folder} holds a run already; resume it with --resume, or name another folder")


def _read_header(path: Path) -> RunHeader:
    if not path.exists():
        raise WrongUse(f"{path.parent} is not a run: it has no run.json; give the folder that a run wrote")
    try:
        return header_of(path.read_bytes(), path)
    except OSError as error:
        raise RecordingDamaged(f"{path} cannot be read: {(error.strerror or str(error)).lower()}") from error


def header_of(data: bytes, path: Path) -> RunHeader:
    """What the bytes of a ``run.json`` say; ``RecordingDamaged`` naming the file where they are others."""
    try:
        return _checked(json.loads(data, parse_constant=_no_constant), path)
    except (ValueError, RecursionError) as error:
        raise RecordingDamaged(f"{path} is not JSON as a run writes it; {_COPY}") from error


def _checked(fields: Any, path: Path) -> RunHeader:
    schema = fields.get("schema") if isinstance(fields, dict) else None
    if schema not in (SCHEMA, _UNSUMMED) or isinstance(schema, bool):
        raise RecordingDamaged(f"{path}: schema {schema!r}; this version reads {_UNSUMMED} and {SCHEMA}")
    if schema == SCHEMA and fields.pop(SUM, None) != sum_of_values(fields):
        raise RecordingDamaged(f"{path}: its values do not agree with its checksum; {_COPY}")
    try:
        # As JSON: of Python values the strict check asks for the dataclass itself.
        _HEADER.validate_json(json.dumps(fields), strict=True, extra="forbid")
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(str(part) for part in first["loc"])
        raise RecordingDamaged(f"{path}: {key!r}: {first['msg'].lower()}; {_COPY}") from error
    return RunHeader(**fields)


def _no_constant(name: str) -> float:
    raise ValueError(name)


_HEADER = TypeAdapter(RunHeader)
_COPY = "take the file from a copy of the run"
