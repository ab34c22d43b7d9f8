"""What an experiment is: a value that says how to plan it, perform it, answer it and score the answer.

Everything else that a run needs is done for every experiment alike by the modules beside this one: begin and
rehearse, perform and resume, replay, compare, write the result and the report, tables, cost.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Generic, Protocol, TypeAlias, TypeVar

from harness.basics.files.json_file import JsonObject
from harness.basics.mesh import Mesh
from harness.bench.scene import SceneFile, Section
from harness.bench.station import Bench
from harness.bench.station_file import Station
from harness.effects.accuracy import Accuracy, Knob, Level
from harness.effects.catalogue import EFFECTS
from harness.effects.effect import knobs_of
from harness.effects.quantities import Quantities
from harness.experiment.report_content import RunReport
from harness.experiment.truth import Truth
from harness.recording.run_folder import RunFiles
from harness.recording.session import StepPerformer
from harness.recording.step_file import StepRecord

if TYPE_CHECKING:  # a report knows experiments and needs no simulator of the arm
    from harness.experiment.compare import Comparison
    from harness.experiment.measuring import Measurement
    from harness.twin.bench import TwinBench
    from harness.twin.rehearsal import RehearsalReport


@dataclass(frozen=True, eq=False)
class Planned:
    """A run, planned and rehearsed."""

    steps: Sequence[JsonObject]  #: the parameters of each.
    rehearsal: "RehearsalReport"  #: what the twin found.
    bench: "TwinBench"  #: the twin it was rehearsed in.
    described: JsonObject = field(default_factory=dict)
    """more that ``run.json`` keeps of the plan."""
    on_the_way: int = 0  #: how many steps are planned, and rehearsed, once those before them are read.


@dataclass(frozen=True, eq=False)
class Helpers:
    """What a step's performer may use beside the bench."""

    twin: "TwinBench"  #: finds a way where the arm is not where a step's travel was planned from.
    ask: Callable[[str], None] | None = None  #: shows a person what to do; None where nobody is there.
    say: Callable[[str], None] = lambda _: None  #: tells how the step goes.


class Answering(Protocol):
    """Readings of a run: each step is read once, and all that needs the readings has them from here."""

    def read(self, record: StepRecord) -> None:
        """Take in one step's readings, in order."""


Readings_co = TypeVar("Readings_co", bound=Answering, covariant=True)
Answer_co = TypeVar("Answer_co", covariant=True)


@dataclass(frozen=True, eq=False)
class Scored(Generic[Readings_co, Answer_co]):
    """An answer with what it is compared with."""

    run: RunFiles  #: folder of the run.
    answering: Readings_co  #: the readings.
    found: Answer_co  #: the answer.
    truth: Truth | None  #: truth of a mocked run; None at a real bench.
    accuracy: Accuracy  #: the chosen level of every knob.
    warnings: tuple[str, ...]  #: warnings for the operator.
    result: JsonObject = field(default_factory=dict)  #: the answer as JSON values.
    folder: Path | None = None  #: folder of ``result.json`` and the files that it names; None if none.


AnyScored: TypeAlias = Scored[Answering, object]
"""A scored answer of any experiment."""


@dataclass(frozen=True)
class ErrorBound:
    """The smallest error that a run can state, known before anything moves."""

    error: float
    """m; every run of the scene states at least this."""

    reason: str
    """Cause of the limit, as the end of a sentence that begins with the error."""

    advice: str
    """Advice: a change that lowers it, or an alternative."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Procedure:
    """A task of the arm at a bench, whatever its readings serve: an experiment or a calibration."""

    name: str  #: in run folders, and on the command line.
    step: str  #: what a step is called: ``"contact"``.
    section: type[Section] | None = None  #: the model of its table in a scene file; None where it has none.
    plan: Callable[[SceneFile, Station, Mesh, int], Planned]  #: chooses the steps and rehearses them.
    performer: Callable[[RunFiles, Helpers], StepPerformer[Bench]]  #: of the steps, at an open bench.
    plan_key: str = "steps"  #: where ``run.json`` keeps the steps.
    gap: str | None = None  #: of a mocked bench where none is asked for; None for the station's.
    assumed: Mapping[str, JsonObject] = field(default_factory=dict)
    """default tables and keys of a scene made from options; ``scale`` may be hidden if that is assumed."""
    error_key: str | None = None
    """of its table, that ``--error`` sets: the run itself ends when that is met; None where ``--error``
    chooses the levels of the answer."""
    smallest_error: Callable[[SceneFile, Mesh], ErrorBound] | None = None
    """lower bound of the error that a run states, of a scene and its mesh; needed with ``error_key``."""

    @property
    def plural(self) -> str:
        """Of what a step is called."""
        return f"{self.step}{'es' if self.step.endswith(('s', 'x', 'ch')) else 's'}"


@dataclass(frozen=True, eq=False, kw_only=True)
class Experiment(Procedure, Generic[Readings_co, Answer_co]):
    """An experiment whose readings are a ``Readings_co`` and whose answer is an ``Answer_co``."""

    title: str  #: title of its report.
    knobs: tuple[Knob[Level], ...]  #: every knob of its answer and its comparison.
    answering: Callable[[RunFiles, Accuracy], Readings_co]
    """creates the readings of a run, makes what depends on the object alone, and loads all kernels."""
    estimate: Callable[[Readings_co], Answer_co]
    """computes the answer from the steps read so far; raises ``FitRefused`` if nothing explains them."""
    result: Callable[[Scored[Readings_co, Answer_co]], JsonObject]
    """the answer as JSON values, keys with their units, with ``seconds`` and ``warnings``."""
    lines: Callable[[JsonObject], list[str]]  #: human-readable answer, from the whole result.
    sources: Callable[[Scored[Readings_co, Answer_co]], Quantities]  #: what the answer gives the comparison.
    gives: tuple[str, ...]
    """names of those sources; anything else that a scene observes is refused before anything moves, and
    without any source a scene observes nothing by default."""
    report: Callable[[Scored[Readings_co, Answer_co], "Comparison", Path], RunReport] | None = None
    """returns its part of a run's page and writes the pictures into the page's folder; None for a page with
    the numbers of the result and without pictures."""
    count_steps: Callable[[SceneFile], int] | None = None
    """number of steps of a scene's run; None if it takes no ``--budget``."""
    measurement: "type[Measurement] | None" = None
    """its class for tables, cost and budgets; None for one that varies its own knobs."""
    measured: str = ""
    """what it finds of the object, so that no scene of it states it and readings have no model to be compared
    with: a sentence; empty where shape, size and pose are stated."""

    @property
    def own_knobs(self) -> tuple[Knob[Level], ...]:
        """Those dials that are not the simulation's."""
        simulated = {knob.name for knob in knobs_of(EFFECTS)}
        return tuple(knob for knob in self.knobs if knob.name not in simulated)


AnyExperiment: TypeAlias = Experiment[Answering, object]
"""An experiment that is known by its name alone; its readings go back to itself only."""
