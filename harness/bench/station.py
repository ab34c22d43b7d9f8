"""The bench, opened: the station's instruments by name, all of them, or each by itself."""

import logging
import os
import time
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import TracebackType
from typing import Protocol, TypeVar, cast

from harness.basics.errors import BenchFault, SafetyStop, TouchstoneError, WrongUse
from harness.basics.mesh import Mesh
from harness.bench.device import (
    ARM,
    GEL,
    Arm,
    Health,
    Instrument,
    InstrumentName,
    MovingInstrument,
    TactileCamera,
)
from harness.bench.gap import gap_path
from harness.bench.mock_lab import MockLab
from harness.bench.scene import SceneFile, scene_from_options
from harness.bench.station_file import Station

_LOG = logging.getLogger(__name__)

PRESS, STRIKE, LOOK, BARE = range(4)
"""The samples of a step: the gel pressed on the object, the hammer fired before it, the scene camera's
picture, the same without the object."""


class Mark(Protocol):
    """Says at which step and sample the run is; -1 before the first sample of a step."""

    def __call__(self, step: int, sample: int) -> None:
        """A mocked world draws its errors for that step and sample; a real bench ignores it."""


def _ignore_mark(step: int, sample: int) -> None:
    """What a real bench does with a mark."""


_D = TypeVar("_D", bound=Instrument)


@dataclass(frozen=True)
class Bench:
    """Instruments, open, and how they are mounted."""

    station: Station  #: they belong to.
    instruments: Mapping[str, Instrument]  #: by name, in opening order; those that the scene calls for.
    mark: Mark = _ignore_mark  #: see ``Mark``.
    pause: Callable[[float], None] = time.sleep  #: waits for so many seconds of the bench's own time.
    lab: MockLab | None = None  #: behind a mocked bench, for cueing faults; None at a real one.
    simulated_clock: Callable[[], float] | None = None
    """returns s of simulated time, by which readings are stamped; None where the readings are stamped by the
    system's monotonic clock."""
    failures: Mapping[str, TouchstoneError] = field(default_factory=dict)
    """why an instrument did not open, by name; empty on a bench that opens as a whole."""

    @property
    def arm(self) -> Arm:
        """The arm; raises as ``get``."""
        return self.get(ARM)

    @property
    def gel(self) -> TactileCamera:
        """The tactile camera on the flange; raises as ``get``."""
        return self.get(GEL)

    def find(self, name: InstrumentName[_D]) -> _D | None:
        """Return an instrument; None where it is not open."""
        return cast("_D | None", self.instruments.get(name))

    def get(self, name: InstrumentName[_D]) -> _D:
        """Return an instrument that this bench must have.

        Raises:
            WrongUse: the station has none, or the scene does not call for it.
            TouchstoneError: why it did not open.
        """
        found = self.find(name)
        if found is not None:
            return found
        if name in self.failures:
            raise self.failures[name]
        self.station.require_section(name)
        raise WrongUse(f"the {name} is not open: the scene does not call for it")

    def health(self) -> dict[str, Health]:
        """Return how each instrument is doing, by name."""
        return {name: instrument.health() for name, instrument in self.instruments.items()}


@dataclass(frozen=True)
class RunContext:
    """What a mocked bench must know of the run it is opened for."""

    truth: Path  #: where the world writes what is true.
    mesh: Mesh  #: of the object, in metres, as the run is planned with.
    seed: int = 0  #: of the world.
    gap: str | None = None  #: reality gap by name or path; None for the station's own.
    run_id: str = ""  #: identity of the run, which the truth repeats; empty where no run is recorded.


@contextmanager
def open_station(
    station: Station,
    scene: SceneFile,
    run: RunContext,
    only: Collection[str] | None = None,
    each: bool = False,
) -> Iterator[Bench]:
    """Open instruments; on exit stop the arm first, close the rest, end the mocked lab.

    Args:
        station: to open.
        scene: selects the instruments, and is what a mocked world shows.
        run: the run this is for.
        only: names of the instruments to open; None for all that the scene calls for.
        each: whether an instrument that does not open is named in ``Bench.failures`` and the others stay
            open; else nothing is opened.

    Raises:
        WrongUse: the station has no such instrument.
        BenchFault: one or more instruments did not open: each is named, with the cable to check.
        SafetyStop: one of them refused for safety's sake.
    """
    with ExitStack() as stack:
        if only is None:
            sections = station.sections_for(scene.sensors)
        else:
            sections = {name: station.require_section(name) for name in only}
        where, lab = _wired(stack, station, scene, run)
        built: dict[str, Instrument] = {}
        opened: dict[str, Instrument] = {}
        failures: dict[str, TouchstoneError] = {}

        def alarm() -> str:
            """Return why no motion may go on; empty while there is no reason."""
            guards = (name for name, section in sections.items() if section.guards_motion and name in opened)
            return next(filter(None, (opened[name].health().failure for name in guards)), "")

        for name in sections:
            try:
                built[name] = where.sections[name].build(where, alarm)
            except TouchstoneError as error:
                if not each:
                    raise
                failures[name] = error
        for name, instrument in built.items():
            try:
                instrument.open()
            except TouchstoneError as error:
                failures[name] = error
            else:
                opened[name] = instrument
                stack.push(_Closing(f"{name}, closing", instrument.close))
        if failures and not each:
            _raise_together(failures)
        for name, instrument in reversed(opened.items()):
            if isinstance(instrument, MovingInstrument):
                stack.push(_Closing(f"{name}, stopping", instrument.stop))
        mark = _ignore_mark if lab is None else lab.mark
        yield Bench(station, opened, mark, lab=lab, failures=failures)


def _raise_together(failures: Mapping[str, TouchstoneError]) -> None:
    """Raise what kept instruments from opening, as one error."""
    if len(failures) == 1:
        raise next(iter(failures.values()))
    listed = "".join(f"\n  - {name}: {error}" for name, error in failures.items())
    unsafe = any(isinstance(error, SafetyStop) for error in failures.values())
    kind = SafetyStop if unsafe else BenchFault
    raise kind(f"{len(failures)} instruments did not open:{listed}")


def _wired(
    stack: ExitStack, station: Station, scene: SceneFile, run: RunContext
) -> tuple[Station, MockLab | None]:
    """The station with the addresses of its instruments, and the lab behind a mocked one."""
    if station.mock is None:
        return station, None
    gap = gap_path(run.gap or station.mock.gap)
    lab = MockLab(scene, station, run.mesh, run.seed, gap, run.truth, run_id=run.run_id)
    stack.callback(lab.close)
    started = lab.start()
    _surround(stack, started.environment)
    return station.with_addresses(started.addresses), lab


def _surround(stack: ExitStack, environment: Mapping[str, str]) -> None:
    """Have these in this process's environment until the bench is closed: sound libraries look there."""
    before = {name: os.environ[name] for name in environment if name in os.environ}
    os.environ.update(environment)

    def restore() -> None:
        for name in environment:
            os.environ.pop(name, None)
        os.environ.update(before)

    stack.callback(restore)


@dataclass(frozen=True)
class _Closing:
    """One thing to do on the way out, which hides no earlier failure."""

    what: str
    action: Callable[[], None]

    def __call__(
        self, _kind: type[BaseException] | None, error: BaseException | None, _trace: TracebackType | None
    ) -> bool:
        try:
            self.action()
        except TouchstoneError as failure:
            if error is None:
                raise
            _LOG.warning("%s: %s", self.what, failure)
        return False


def scene_of_all(station: Station, scene: SceneFile | None = None) -> SceneFile:
    """Return a scene that calls for every instrument of a station; of the mug where none is given."""
    scene = scene or scene_from_options("builtin:mug")
    has = {"sound": station.hammer is not None, "camera": station.camera is not None}
    return scene.model_copy(update={"sensors": scene.sensors.model_copy(update=has)})


@dataclass(frozen=True)
class Checked:
    """Health of the instruments of a bench."""

    instruments: tuple[Health, ...]  #: those that opened and send something.
    failures: Mapping[str, TouchstoneError]  #: by name, why the others do not.
    safety: str | None  #: the arm's; None where the arm did not open.
    levels: Mapping[str, Mapping[str, float]]  #: what instruments read at rest, by name.


def check_bench(bench: Bench) -> Checked:
    """Read each instrument that opened; one that sends nothing fails alone."""
    found: dict[str, Health] = {}
    failures = dict(bench.failures)
    levels: dict[str, Mapping[str, float]] = {}
    remarks: dict[str, str] = {}
    for name, instrument in bench.instruments.items():
        try:
            at_rest = bench.station.sections[name].probe(name, bench)
            found[name] = instrument.health()
        except TouchstoneError as error:
            failures[name] = error
        else:
            levels[name] = at_rest.levels
            remarks |= at_rest.remarks
    healths = tuple(
        replace(health, detail="; ".join(filter(None, (remarks.get(name), health.detail))))
        for name, health in found.items()
    )
    arm = bench.find(ARM)
    return Checked(healths, failures, None if arm is None else arm.state().safety, levels)
