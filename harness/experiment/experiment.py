"""What an experiment is: a value that says how to plan it, perform it, answer it and score the answer.

Everything else that a run needs is done for every experiment alike by the modules beside this one: begin and
rehearse, perform and resume, replay, compare, write the result and the report, tables, cost.
"""

from collections.abc import Callable, Mapping, MutableMapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Protocol

from harness.basics.mesh import Mesh
from harness.bench.device import Health
from harness.bench.scene import SceneFile, Section
from harness.bench.station import Bench
from harness.bench.station_file import Station
from harness.cost.curve import Sample
from harness.effects.accuracy import Accuracy, Knob, Level, Setting
from harness.effects.catalogue import EFFECTS
from harness.effects.effect import knobs_of
from harness.experiment.solving import Budgets
from harness.experiment.truth import Truth
from harness.recording.run_folder import RunFiles
from harness.recording.session import StepPerformer
from harness.recording.step_file import StepRecord

if TYPE_CHECKING:  # a report knows experiments and needs no simulator of the arm
    from harness.twin.bench import TwinBench
    from harness.twin.rehearsal import RehearsalReport


@dataclass(frozen=True, eq=False)
class Planned:
    """A run, planned and rehearsed.

    Attributes:
        steps: the parameters of each, as JSON values.
        rehearsal: what the twin found.
        bench: the twin it was rehearsed in.
        described: more that ``run.json`` keeps of the plan, as JSON values.
        on_the_way: how many steps are planned, and rehearsed, once those before them are read.
    """

    steps: Sequence[Mapping[str, Any]]
    rehearsal: "RehearsalReport"
    bench: "TwinBench"
    described: Mapping[str, Any] = field(default_factory=dict)
    on_the_way: int = 0


@dataclass(frozen=True, eq=False)
class Helpers:
    """What a step's performer may use beside the bench.

    Attributes:
        twin: finds a way where the arm is not where a step's travel was planned from.
        ask: shows a person what to do; None where nobody is there.
        say: tells how the step goes.
    """

    twin: "TwinBench"
    ask: Callable[[str], None] | None = None
    say: Callable[[str], None] = lambda _: None


class Answering(Protocol):
    """Readings to answer: each step is read once, and all that needs the readings has them from here."""

    def read(self, record: StepRecord) -> None:
        """Take in one step's readings, in order."""

    def answer(self) -> Any:
        """What the steps read so far say.

        Raises:
            FitRefused: nothing explains the readings.
            WrongUse: no step was read.
        """


@dataclass(frozen=True, eq=False)
class Scored:
    """An answer with what it is held against.

    Attributes:
        run: the folder.
        answering: the readings.
        found: the answer, as the experiment has it.
        truth: of a mocked run.
        accuracy: the chosen level of every dial.
        warnings: what the operator should know.
        result: the answer as JSON values.
    """

    run: RunFiles
    answering: Any
    found: Any
    truth: Truth | None
    accuracy: Accuracy
    warnings: tuple[str, ...]
    result: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class MeasuredCondition:
    """What a table or a cost curve varies beside object and seed.

    Attributes:
        name: ``"spacing"``.
        levels: all that there are.
        usual: those that a cost curve measures where nobody says.
        tabled: those of a table.
    """

    name: str
    levels: tuple[str, ...]
    usual: tuple[str, ...]
    tabled: tuple[str, ...] = ()


@dataclass(frozen=True)
class MeasuredColumn:
    """A mean that a table shows beside the errors, over the runs whose rows have it.

    Attributes:
        key: of a row's JSON values: a number, or a bool of which the share is shown.
        heading: over it.
        unit: ``"mm"`` of a value in metres, ``"%"`` of a share.
    """

    key: str
    heading: str
    unit: Literal["mm", "%"]


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


class RunsCell(Protocol):
    """Performs one run of a table in process and answers it by every method."""

    def __call__(
        self, cell: Any, scene: SceneFile, station: Station, recordings: Path | None = None
    ) -> dict[str, Any]:
        """The result as JSON values; the run itself is kept in, or taken from, the folder of recordings."""


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


class Perform(Protocol):
    """Performs runs, side by side where there is a pool of processes; tells of each that could not be."""

    def __call__(
        self,
        cells: Sequence[Any],
        scenes: Mapping[str, SceneFile],
        station: Station,
        pool: Executor | None,
        models: MutableMapping[str, Any],
        say: Say,
    ) -> dict[Any, Any]:
        """The cases by cell; ``models`` is taken from and added to."""


@dataclass(frozen=True)
class Measurement:
    """How tables and cost curves measure an experiment.

    Attributes:
        estimator: module whose sources, with all they import, decide whether a curve still holds.
        conditions: what is varied beside object, gap and seed.
        cells: the runs of so many objects, seeds and levels of the conditions, ``gap`` among them.
        run_cell: performs one in process and answers it by every method: ``rows`` by method, each with
            ``error_m`` and ``seconds``; a share of rows may have ``error_symmetric_m``, ``in_region90``,
            ``refused``, and ``gross`` where an error beyond ``gross`` m is not what a failure is.
        methods: in the order of a table's rows.
        performed: runs for a cost curve.
        settings: of the dials, that a cost curve measures: every one of them, or the usual ones.
        setting_name: of a setting, for people.
        fewer: settings that are measured with fewer steps too.
        counts: of steps, that a cost curve measures where nobody says.
        regions: methods whose 90 % region a table scores.
        gross: m: an error beyond this is a failure.
        notes: sentences that a curve keeps, from the models made on the way.
        published: what others printed, by method; for the foot of a table.
        subjects: real meshes beside those of every experiment: file under the data folder, units, material.
        columns: means beside the errors, in the order of a table.
        per_object: keys of rows, lengths, whose mean on each object is printed too.
    """

    estimator: str
    conditions: tuple[MeasuredCondition, ...]
    cells: Callable[[Sequence[str], Sequence[int], Mapping[str, Sequence[str]]], Sequence[Any]]
    run_cell: RunsCell
    methods: tuple[str, ...]
    performed: Perform
    settings: Callable[[bool, Mapping[str, Sequence[str]], Mapping[str, SceneFile]], Sequence[Setting]]
    setting_name: Callable[[Setting], str]
    fewer: Callable[[Mapping[str, Sequence[str]]], Sequence[Setting]] | None = None
    counts: tuple[int, ...] = (1,)
    regions: tuple[str, ...] = ()
    gross: float = 20.0e-3
    notes: Callable[[Mapping[str, Any]], tuple[str, ...]] = lambda _: ()
    published: Mapping[str, Sequence[float]] = field(default_factory=dict)
    subjects: Mapping[str, tuple[str, str, str]] = field(default_factory=dict)
    columns: tuple[MeasuredColumn, ...] = ()
    per_object: tuple[str, ...] = ()


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
    """What an arm is to do at a bench, whatever is made of the readings: an experiment's or a calibration's.

    Attributes:
        name: in run folders, and on the command line.
        step: what a step is called: ``"contact"``.
        section: the model of its table in a scene file; None where it has none.
        plan: chooses the steps and rehearses them.
        performer: of the steps, at an open bench.
        plan_key: where ``run.json`` keeps the steps.
        gap: of a mocked bench where none is asked for; None for the station's.
        observe: in place of what a scene file observes by default; None for just that.
        assumed: tables and keys of a scene made from options, where they say nothing else.
        error_key: of its table, that ``--error`` sets: the run itself ends when that is met; None where
            ``--error`` chooses the levels of the answer.
        smallest_error: lower bound of the error that a run states, of a scene and its mesh; needed with
            ``error_key``.
        sizes_unknown: whether it can do with an object whose size is hidden.
    """

    name: str
    step: str
    section: type[Section] | None = None
    plan: Callable[[SceneFile, Station, Mesh, int], Planned]
    performer: Callable[[RunFiles, Helpers], StepPerformer[Bench]]
    plan_key: str = "steps"
    gap: str | None = None
    observe: tuple[str, ...] | None = None
    assumed: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    error_key: str | None = None
    smallest_error: Callable[[SceneFile, Mesh], ErrorBound] | None = None
    sizes_unknown: bool = False

    @property
    def plural(self) -> str:
        """Of what a step is called."""
        return f"{self.step}{'es' if self.step.endswith(('s', 'x', 'ch')) else 's'}"


@dataclass(frozen=True, eq=False, kw_only=True)
class Experiment(Procedure):
    """One kind of question that a bench is asked.

    Attributes:
        title: of its report.
        knobs: every dial that its answer and its comparison have.
        answering: of a run, at an accuracy.
        result: the answer as JSON values, keys with their units, with ``seconds`` and ``warnings``.
        lines: the answer for people, from the whole result.
        sources: what the answer gives the comparison, by name.
        gives: the names of those sources; what else a scene observes is refused before anything moves.
        report: writes the page of a scored run; None for the plain page of every experiment.
        files: writes what the answer is beside its JSON values into the folder of ``result.json``, where the
            result names it; None for nothing.
        budgets: answers to a budget or an error; None where it cannot.
        measurement: for tables and cost; None where it has none.
        measured: what it finds of the object, so that no scene of it states it and readings have no model to
            be compared with: a sentence; empty where shape, size and pose are stated.
    """

    title: str
    knobs: tuple[Knob[Level], ...]
    answering: Callable[[RunFiles, Accuracy], Answering]
    result: Callable[[Scored], dict[str, Any]]
    lines: Callable[[Mapping[str, Any]], list[str]]
    sources: Callable[[Scored], Mapping[str, Any]]
    gives: tuple[str, ...]
    report: Callable[[Scored, Any, Mapping[str, Health] | None, Path], Path] | None = None
    files: Callable[[Scored, Path], None] | None = None
    budgets: Budgets | None = None
    measurement: Measurement | None = None
    measured: str = ""

    @property
    def own_knobs(self) -> tuple[Knob[Level], ...]:
        """Those dials that are not the simulation's."""
        simulated = {knob.name for knob in knobs_of(EFFECTS)}
        return tuple(knob for knob in self.knobs if knob.name not in simulated)
