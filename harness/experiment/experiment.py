"""What an experiment is: a value that says how to plan it, perform it, answer it and score the answer.

Everything else that a run needs is done for every experiment alike by the modules beside this one: begin and
rehearse, perform and resume, replay, compare, write the result and the report, tables, cost.
"""

from collections.abc import Callable, Mapping, MutableMapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Generic, Literal, Protocol, TypeAlias, TypeVar

from harness.basics.files.json_file import JsonObject
from harness.basics.mesh import Mesh
from harness.bench.device import Health
from harness.bench.scene import SceneFile, Section
from harness.bench.station import Bench
from harness.bench.station_file import Station
from harness.cost.curve import Sample
from harness.effects.accuracy import Accuracy, Knob, Level, Setting
from harness.effects.catalogue import EFFECTS
from harness.effects.effect import knobs_of
from harness.effects.quantities import Quantities
from harness.experiment.solving import AnyBudgets
from harness.experiment.truth import Truth
from harness.recording.run_folder import RunFiles
from harness.recording.session import StepPerformer
from harness.recording.step_file import StepRecord

if TYPE_CHECKING:  # a report knows experiments and needs no simulator of the arm
    from harness.experiment.compare import Comparison
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


AnyScored: TypeAlias = Scored[Answering, object]
"""A scored answer of any experiment."""


@dataclass(frozen=True)
class MeasuredCondition:
    """What a table or a cost curve varies beside object and seed."""

    name: str  #: ``"spacing"``.
    levels: tuple[str, ...]  #: all that there are.
    usual: tuple[str, ...]  #: those that a cost curve measures where nobody says.
    tabled: tuple[str, ...] = ()  #: those of a table.


@dataclass(frozen=True)
class MeasuredColumn:
    """A mean that a table shows beside the errors, over the runs whose rows have it."""

    key: str  #: of a row's JSON values: a number, or a bool of which the share is shown.
    heading: str  #: over it.
    unit: Literal["mm", "%"]  #: ``"mm"`` of a value in metres, ``"%"`` of a share.


class RunCell(Protocol):
    """One run of a table or a cost curve."""

    @property
    def object(self) -> str:
        """Its name among the subjects."""

    @property
    def seed(self) -> int:
        """Of the places, the world and the draws."""

    @property
    def name(self) -> str:
        """Of the run's file."""

    @property
    def conditions(self) -> Mapping[str, str]:
        """What was varied, by name; ``gap`` always among them."""


class RunCase(Protocol):
    """A performed run with its truth, to be answered at any setting."""

    @property
    def cell(self) -> RunCell:
        """Which run."""

    @property
    def steps(self) -> int:
        """How many were performed."""

    def sample(self, setting: Setting, steps: int) -> Sample:
        """The error and the seconds of an answer from the first steps."""

    def close(self) -> None:
        """It is not answered again; what it keeps on the disk can go."""


Say = Callable[[str], None]


Cell_co = TypeVar("Cell_co", bound=RunCell, covariant=True)
Models_co = TypeVar("Models_co", covariant=True)


@dataclass(frozen=True)
class Measurement(Generic[Cell_co, Models_co]):
    """Measurement of an experiment for tables and cost curves, by runs of ``Cell_co`` with ``Models_co``."""

    estimator: str  #: module whose sources, with all they import, decide whether a curve still holds.
    conditions: tuple[MeasuredCondition, ...]  #: what is varied beside object, gap and seed.
    cells: Callable[[Sequence[str], Sequence[int], Mapping[str, Sequence[str]]], Sequence[Cell_co]]
    """the runs of so many objects, seeds and levels of the conditions, ``gap`` among them."""
    run_cell: Callable[[Cell_co, SceneFile, Station, Path | None], JsonObject]
    """performs a run in process, or takes it from the folder of recordings, and answers it by every method:
    ``rows`` by method, each with ``error_m`` and ``seconds``; a share of rows may have
    ``error_symmetric_m``, ``in_region90``, ``refused``, and ``gross`` where an error beyond ``gross`` m is
    not what a failure is."""
    methods: tuple[str, ...]  #: in the order of a table's rows.
    performed: Callable[
        [
            Sequence[Cell_co],
            Mapping[str, SceneFile],
            Station,
            Executor | None,
            MutableMapping[str, Models_co],
            Say,
        ],
        Mapping[Cell_co, RunCase],
    ]
    """performs the runs of a cost curve, in parallel if there is a pool of processes, and reports each that
    failed; models by object are taken from and added to the mapping."""
    settings: Callable[[bool, Mapping[str, Sequence[str]], Mapping[str, SceneFile]], Sequence[Setting]]
    """of the dials, that a cost curve measures: every one of them, or the usual ones."""
    setting_name: Callable[[Setting], str]  #: of a setting, for people.
    fewer: Callable[[Mapping[str, Sequence[str]]], Sequence[Setting]] | None = None
    """settings that are measured with fewer steps too."""
    counts: tuple[int, ...] = (1,)  #: of steps, that a cost curve measures where nobody says.
    regions: tuple[str, ...] = ()  #: methods whose 90 % region a table scores.
    gross: float = 20.0e-3  #: m: an error beyond this is a failure.
    notes: Callable[[JsonObject], tuple[str, ...]] = lambda _: ()
    """sentences that a curve keeps, from the models made on the way."""
    published: Mapping[str, Sequence[float]] = field(default_factory=dict)
    """what others printed, by method; for the foot of a table."""
    subjects: Mapping[str, tuple[str, str, str]] = field(default_factory=dict)
    """real meshes beside those of every experiment: file under the data folder, units, material."""
    columns: tuple[MeasuredColumn, ...] = ()  #: means beside the errors, in the order of a table.
    per_object: tuple[str, ...] = ()  #: keys of rows, lengths, whose mean on each object is printed too.


AnyMeasurement: TypeAlias = Measurement[RunCell, object]
"""A measurement of any experiment; its cells and models go back to itself only."""


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
    observe: tuple[str, ...] | None = None
    """in place of what a scene file observes by default; None for just that."""
    assumed: Mapping[str, JsonObject] = field(default_factory=dict)
    """tables and keys of a scene made from options, where they say nothing else."""
    error_key: str | None = None
    """of its table, that ``--error`` sets: the run itself ends when that is met; None where ``--error``
    chooses the levels of the answer."""
    smallest_error: Callable[[SceneFile, Mesh], ErrorBound] | None = None
    """lower bound of the error that a run states, of a scene and its mesh; needed with ``error_key``."""
    sizes_unknown: bool = False  #: whether it can do with an object whose size is hidden.

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
    """the names of those sources; what else a scene observes is refused before anything moves."""
    report: (
        Callable[[Scored[Readings_co, Answer_co], "Comparison", Mapping[str, Health] | None, Path], Path]
        | None
    ) = None
    """writes the page of a scored run; None for the plain page of every experiment."""
    files: Callable[[Scored[Readings_co, Answer_co], Path], None] | None = None
    """writes what the answer is beside its JSON values into the folder of ``result.json``, where the result
    names it; None for nothing."""
    budgets: AnyBudgets | None = None  #: answers to a budget or an error; None where it cannot.
    measurement: AnyMeasurement | None = None  #: for tables and cost; None where it has none.
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
