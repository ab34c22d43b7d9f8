"""Perform what is left of a run on its bench; a step's readings are taken in once it is on the disk."""

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass

from harness.basics.clock import clock_offset_ns, now
from harness.basics.files.json_file import JsonObject
from harness.bench.device import Health
from harness.bench.experiments import loaded
from harness.bench.station import Bench, open_station
from harness.effects.accuracy import Accuracy
from harness.experiment.experiment import Answering, Experiment, Helpers, Procedure
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.recording.session import Progress, perform
from harness.recording.step_file import Step
from harness.skills.strike import Ask, by_hand, somebody
from harness.twin.bench_of import twin_of

WIRES, IN_PROCESS = "wires", "in-process"
"""Mocked benches: each instrument at the far end of its cable, or the same world without cables, in simulated
time."""

_BENCHES = {
    WIRES: "mocked, each instrument at the far end of its cable, in real time",
    IN_PROCESS: "mocked in this process, in simulated time (a new run takes --bench wires for the cables)",
}

IN_PROCESS_BENCH = "mocks.in_process.bench:in_process_bench"
"""Import string of the latter."""


@dataclass(frozen=True, eq=False)
class Performed:
    """What came of a session at a bench."""

    complete: bool  #: whether every step was performed; False where Ctrl-C ended it early.
    health: dict[str, Health]  #: how the instruments did, by name.
    answering: Answering | None = None  #: the readings taken in on the way; None where none were to be.
    ended: float | None = None
    """s on the bench clock, when the last step was on the disk; None where none was performed."""


def steps_planned(procedure: Procedure, recording: Recording) -> int:
    """How many steps the run was planned with."""
    return len(recording.planned(procedure.plan_key))


def describe_bench(recording: Recording) -> str:
    """Return the bench that a run uses, in words for the operator."""
    mock = recording.header.mock
    return "the real instruments" if mock is None else _BENCHES[_mocked_as(mock)]


def _mocked_as(mock: JsonObject) -> str:
    """Return how a run's bench is mocked; runs older than the key used their wires."""
    return str(mock.get("bench", WIRES))


def perform_on_bench(
    procedure: Procedure,
    run: RunFiles,
    progress: Progress,
    ask: Ask | None = None,
    accuracy: Accuracy | None = None,
    say: Callable[[str], None] = lambda _: None,
    conclude: Callable[[Performed], None] = lambda _: None,
) -> Performed:
    """Open the run's bench and perform what is left.

    What the readings will be compared with is made, and its kernels are loaded, while the bench opens and
    before anything moves: what cannot be answered at all is refused while the arm still stands.

    Args:
        procedure: that the run is of.
        run: folder of the run; its readings are shared with whoever else has it.
        progress: is told of each step.
        ask: shows a person what to do, where the station has one strike; None where nobody is there.
        accuracy: of the answer; None where no readings are to be taken in on the way.
        say: tells how a step goes.
        conclude: is given what came of it while the bench is still open: closing one takes its time.

    Raises:
        MeshRefused: the answer needs the object's sound, or a mocked bench makes it, and its surface cannot
            be filled.
    """
    if by_hand(run.scene, run.station):
        somebody(ask)
    ahead = ThreadPoolExecutor(1, "model")
    answering = None
    if accuracy is not None and isinstance(procedure, Experiment):
        answering = ahead.submit(procedure.answering, run, accuracy)
    ahead.shutdown(wait=False)  # a bench that does not open says so at once
    with _bench_of(run) as bench:
        made = None if answering is None else answering.result()
        performed = perform_on(procedure, bench, run, progress, ask, made, say)
        if performed.complete:
            conclude(performed)
    return performed


@contextmanager
def _bench_of(run: RunFiles) -> Iterator[Bench]:
    """The bench that a run was begun for, open."""
    recording = run.recording
    if _mocked_as(recording.header.mock or {}) == IN_PROCESS:
        yield loaded(IN_PROCESS_BENCH)(run.scene, run.station, run.context)
        return
    with open_station(run.station, run.scene, run.context) as bench:
        yield bench


def perform_on(
    procedure: Procedure,
    bench: Bench,
    run: RunFiles,
    progress: Progress,
    ask: Ask | None = None,
    answering: Answering | None = None,
    say: Callable[[str], None] = lambda _: None,
) -> Performed:
    """Perform what is left of a run on an open bench, as a session with a clock offset of its own.

    Raises:
        WrongUse: the wall clock is before the end of the last step; nothing has moved.
    """
    recording, offset = run.recording, clock_offset_ns(bench.simulated_clock or now)
    recording.begin_session(offset, is_simulated=bench.simulated_clock is not None)
    helpers = Helpers(twin_of(run.scene, run.station, run.mesh), ask, say)
    if answering is not None:
        for record in recording.steps():
            answering.read(record)
    told = _Reading(progress, recording, answering)
    complete = perform(procedure.performer(run, helpers), bench, recording, bench.arm.stop, told)
    return Performed(complete, bench.health(), answering, told.last)


class _Reading:
    """Takes in every step that ends, the arm at rest meanwhile; tells of it as before, and notes when."""

    def __init__(self, progress: Progress, recording: Recording, answering: Answering | None) -> None:
        self.last: float | None = None
        self._progress = progress
        self._recording = recording
        self._answering = answering

    def began(self, step: Step) -> None:
        self._progress.began(step)

    def ended(self, step: Step, seconds: float) -> None:
        self.last = now()
        self._progress.ended(step, seconds)
        if self._answering is not None:
            self._answering.read(self._recording.step(step.index))
