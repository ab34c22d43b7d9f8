"""A run is a folder: what was asked, what was read, and nothing an estimate does not need.

``run.json`` says what the run is; ``steps/NNN.mcap`` hold the readings. A step is on disk
whole or not at all, and the first step that is not is where a run resumes.
"""

import datetime as dt
import json
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from harness.basics.clock import now
from harness.basics.errors import RecordingDamaged, WrongUse
from harness.basics.files.foreign_file import MOST_JSON, read_bounded
from harness.basics.files.json_file import CHECKSUM, checksum_of, parse_strictly
from harness.basics.files.lock_file import hold_folder
from harness.basics.whole_file import make_folder, write_text_whole
from harness.bench.device import Reading
from harness.bench.named_files import require_run
from harness.recording.step_file import Step, StepRecord, read_step, read_wall_span, write_step

SCHEMA = 3
_READABLE = (1, 2, SCHEMA)
_UNSUMMED = 1
"""The schema of runs whose files carry no checksums; they are read as they are."""

HEADER, STEPS = "run.json", "steps"
"""Names in a run's folder."""

IN_USE = "wait for it to end, or name another folder"
"""Advice for a folder that another program writes to."""

_BACKWARDS_TOLERANCE_NS = 10**9
"""Steps closer than this are in order: wall clocks of two sessions are corrected by fractions of a second."""


@dataclass(frozen=True)
class RunHeader:
    """What a run is, written once before anything moves."""

    experiment: str  #: its name on the command line.
    scene: Mapping[str, Any]  #: the resolved scene, as JSON values.
    station: Mapping[str, Any]  #: the resolved station, as JSON values.
    plan: Mapping[str, Any]  #: the steps that were planned, and how, as JSON values.
    files: Mapping[str, str]  #: content hashes of the files copied into the folder, by name.
    versions: Mapping[str, str]  #: of the project, its git commit and the libraries that shape numbers.
    seed: int  #: of everything random in the run.
    mock: Mapping[str, Any] | None  #: how the mocked bench was started; None at a real bench.
    clock_offset_ns: int
    """wall clock minus bench clock when the run was created; steps carry the offset of their own session."""
    created: str  #: wall time, ISO 8601.
    schema: int = field(default=SCHEMA)  #: of this file.
    run_id: str = ""
    """random identity of the run, which the truth of a mocked run repeats; empty before schema 3."""


class Recording:
    """A run folder, open for reading and for committing further steps."""

    def __init__(self, folder: Path) -> None:
        """Open an existing run; ``RecordingDamaged`` or ``WrongUse`` where it is none."""
        self.folder = folder
        require_run(folder)
        path = folder / HEADER
        data = read_bounded(path, "the description of a run", MOST_JSON, RecordingDamaged)
        self.header = header_of(data, path)
        self._session_offset_ns = self.header.clock_offset_ns

    @classmethod
    def create(cls, folder: Path, header: RunHeader) -> "Recording":
        """Make the folder and its ``run.json``; refuses a folder that holds a run already."""
        require_unused(folder)
        make_folder(folder / STEPS)
        fields = json.loads(json.dumps(asdict(header), allow_nan=False))
        summed = {**fields, CHECKSUM: checksum_of(fields)}
        write_text_whole(folder / HEADER, json.dumps(summed, indent=1, allow_nan=False))
        return cls(folder)

    def hold(self) -> AbstractContextManager[None]:
        """Hold the folder for one writer; ``WrongUse`` where another process performs or answers this run."""
        return hold_folder(self.folder, IN_USE)

    def begin_session(self, clock_offset_ns: int, is_simulated: bool = False) -> None:
        """Set the clock offset of the steps that are committed from now on.

        Args:
            clock_offset_ns: wall clock minus bench clock, measured as the bench was opened.
            is_simulated: whether the bench clock is simulated and starts at 0 in every session. Such a
                session goes on where the last step ended, as simulated time may run ahead of the wall clock.

        Raises:
            WrongUse: the wall clock is before the end of the last step; nothing has moved.
        """
        spans = self._wall_spans()
        if spans:
            last, _, end = spans[-1]
            start = clock_offset_ns + (0 if is_simulated else round(now() * 1e9))
            if is_simulated:
                clock_offset_ns = max(clock_offset_ns, end)
            elif start < end - _BACKWARDS_TOLERANCE_NS:
                raise WrongUse(
                    f"this computer's clock says {_utc(start)}, and step {last + 1} of {self.folder} was "
                    f"recorded until {_utc(end)}; set the clock, then resume"
                )
        self._session_offset_ns = clock_offset_ns

    def order_notes(self) -> tuple[str, ...]:
        """Report each step that begins before the one before it ended, by the wall clock, in one sentence."""
        return tuple(
            f"step {index + 1} was recorded {_duration(end - start)} before step {before + 1} ended, by the "
            "computer's clock: the clock was wrong in one of the sessions, or a step is of another run; "
            "times between steps are not usable"
            for (before, _, end), (index, start, _) in pairwise(self._wall_spans())
            if start < end - _BACKWARDS_TOLERANCE_NS
        )

    def _wall_spans(self) -> list[tuple[int, int, int]]:
        """Index, first and last time stamp, in ns of the wall clock, of each step with readings."""
        summed = self.header.schema != _UNSUMMED
        spans = [(index, read_wall_span(self._path(index), summed)) for index in range(self.committed)]
        return [(index, *span) for index, span in spans if span is not None]

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
        found = sorted(int(path.stem) for path in (self.folder / STEPS).glob("[0-9]*.mcap"))
        if found != list(range(len(found))):
            missing = sorted(set(range(len(found))) - set(found))
            raise RecordingDamaged(f"{self.folder}: step {missing[0]} is missing but later steps are there")
        return len(found)

    def commit(self, step: Step, readings: Sequence[Reading], seconds: float) -> None:
        """Put a performed step on the disk, whole."""
        if step.index != self.committed:
            raise ValueError(f"step {step.index} cannot follow {self.committed} committed steps")
        by_name = {reading.channel.name: reading for reading in readings}
        write_step(self._path(step.index), StepRecord(step, by_name, seconds), self._session_offset_ns)

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
        return self.folder / STEPS / f"{index:03d}.mcap"


def require_unused(folder: Path) -> None:
    """Refuse a folder that holds a run, before anything in it is touched."""
    if (folder / HEADER).exists() or any((folder / STEPS).glob("[0-9]*.mcap")):
        raise WrongUse(f"{folder} holds a run already; resume it with --resume, or name another folder")


def header_of(data: bytes, path: Path) -> RunHeader:
    """Parse the bytes of a ``run.json``; ``RecordingDamaged`` names the file if they are damaged."""
    try:
        fields = parse_strictly(data)
    except (ValueError, RecursionError) as error:
        raise RecordingDamaged(f"{path} is not JSON as a run writes it; {_COPY}") from error
    schema = fields.get("schema") if isinstance(fields, dict) else None
    if schema not in _READABLE or isinstance(schema, bool):
        raise RecordingDamaged(f"{path}: schema {schema!r}; this version reads {_UNSUMMED} to {SCHEMA}")
    if schema != _UNSUMMED and fields.pop(CHECKSUM, None) != checksum_of(fields):
        raise RecordingDamaged(f"{path}: its values do not agree with its checksum; {_COPY}")
    try:
        # As JSON: of Python values the strict check asks for the dataclass itself.
        _HEADER.validate_json(json.dumps(fields), strict=True, extra="forbid")
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(str(part) for part in first["loc"])
        raise RecordingDamaged(f"{path}: {key!r}: {first['msg'].lower()}; {_COPY}") from error
    return RunHeader(**fields)


def _utc(wall_ns: int) -> str:
    return dt.datetime.fromtimestamp(wall_ns / 1e9, dt.UTC).isoformat(sep=" ", timespec="seconds")


def _duration(nanoseconds: int) -> str:
    seconds = nanoseconds / 1e9
    return f"{seconds:.1f} s" if seconds < 120.0 else f"{seconds / 60.0:,.0f} min"


_HEADER = TypeAdapter(RunHeader)
_COPY = "take the file from a copy of the run"
