"""Measure an experiment for tables, cost curves and budgets: recorded runs, answered at every setting."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, as_completed
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal, TypeVar

from harness.basics.errors import FitRefused, TouchstoneError, WrongUse
from harness.basics.files.json_file import JsonObject
from harness.basics.worker_pool import worker_pool
from harness.bench.experiments import EXPERIMENTS, loaded
from harness.bench.scene import SceneFile, scene_from_json
from harness.bench.station_file import Station
from harness.cost.curve import Curve
from harness.effects.accuracy import Accuracy, Level, Setting
from harness.experiment.experiment import Answering, AnyExperiment, Scored
from harness.experiment.in_process import RunCell, open_run, record_run
from harness.experiment.levels import chosen_levels
from harness.experiment.lookup import find_experiment
from harness.experiment.solving import Solved, Solver
from harness.experiment.subjects import REAL, object_key
from harness.experiment.truth import read_truth
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.recording.step_file import StepRecord

TICK = 1.0e-6
"""CPU time in s of an answer that is quicker than the clock of CPU time can measure."""

DEFAULT = "default"
"""Name of the method, and of the setting, with every knob at its default."""


@dataclass(frozen=True)
class MeasuredCondition:
    """A condition that a table or a cost curve varies, in addition to object, gap and seed."""

    name: str  #: ``"spacing"``.
    levels: tuple[str, ...]  #: all levels.
    usual: tuple[str, ...]  #: default levels of a cost curve.
    tabled: tuple[str, ...] = ()  #: default levels of a table; those of a cost curve if empty.


@dataclass(frozen=True)
class MeasuredColumn:
    """A mean that a table shows next to the errors, over the runs whose rows have it."""

    key: str  #: key of a row's JSON values: a number, or a bool whose frequency is shown.
    heading: str  #: heading of the column.
    unit: Literal["mm", "%"]  #: ``"mm"`` for a value in metres, ``"%"`` for a fraction.
    by_object: bool = False  #: whether the mean on each object is printed too.


@dataclass(frozen=True, eq=False)
class PlainRun:
    """A recorded run as a ``Solver`` of any experiment; settings share the inverted pictures."""

    experiment: AnyExperiment  #: the experiment of the run.
    files: RunFiles  #: folder of the run.
    steps: int  #: number of its first steps that are used.

    @property
    def object(self) -> str:
        """Name of the object that its seconds are measured under."""
        return object_key(self.files.scene.object.name, self.files.mesh)

    @property
    def records(self) -> list[StepRecord]:
        """The steps that are used."""
        return [record for record in self.files.recording.steps() if record.step.index < self.steps]

    def first(self, steps: int) -> "PlainRun":
        """Return the run with its first steps alone."""
        return replace(self, steps=steps)

    def explain_refusal(self, _setting: Setting) -> None:
        """Return None: every setting can be answered."""

    def prepare(self, setting: Setting) -> None:
        """Create the readings once, so that an experiment computes and loads its models."""
        self._answering(setting)

    def shares_preparation(self, _one: Setting, _other: Setting) -> bool:
        """State that settings share all preparation."""
        return True

    def work(self, _setting: Setting) -> float:
        """Return the number of steps."""
        return float(self.steps)

    def read(self, _setting: Setting) -> tuple[float, float]:
        """Invert the pictures that were not inverted yet; return CPU and wall time in s of all of them."""
        observed = [self.files.observe(record) for record in self.records if "gel.image" in record.readings]
        seconds = [self.files.gel_reader.read(one.images).seconds for one in observed]
        return sum(cpu for cpu, _ in seconds), sum(wall for _, wall in seconds)

    def solve(self, setting: Setting) -> Solved[JsonObject]:
        """Compute the answer as JSON values, timed from the inverted pictures on."""
        accuracy, answering = self._answering(setting)
        records, answer, refusal = self.records, None, None
        cpu, wall = time.process_time(), time.perf_counter()
        try:
            for record in records:
                answering.read(record)
            answer = self.experiment.estimate(answering)
        except FitRefused as error:
            refusal = str(error)
        cpu, wall = max(time.process_time() - cpu, TICK), time.perf_counter() - wall
        if refusal is not None:
            return Solved(None, None, cpu, wall, refusal)
        truth = read_truth(self.files.recording)
        if truth is not None:
            truth = replace(truth, points={k: v for k, v in truth.points.items() if k < self.steps})
        result = self.experiment.result(Scored(self.files, answering, answer, truth, accuracy, ()))
        position, error_m = result.get("position_m"), result.get("error_m")
        return Solved(result, result.get("credible90_m"), cpu, wall, None, position, error_m)

    def _answering(self, setting: Setting) -> tuple[Accuracy, Answering]:
        accuracy = chosen_levels(self.experiment.knobs, (), self.files.network_levels).with_(setting)
        return accuracy, self.experiment.answering(self.files, accuracy)


class Measurement:
    """Measurement of one experiment, for tables, cost curves and budgets; created for each command.

    Args:
        experiment: the experiment; its own knobs are varied one at a time from their defaults.
    """

    cell: type[RunCell] = RunCell  #: class of its runs.
    conditions: tuple[MeasuredCondition, ...] = ()  #: conditions in addition to object, gap and seed.
    counts: tuple[int, ...] = (1,)  #: default numbers of steps of a cost curve.
    gross = 20.0e-3  #: m: a larger error is a failure, unless a row states ``gross`` itself.
    regions: tuple[str, ...] = ()  #: methods whose 90 % region a table scores.
    published: Mapping[str, Sequence[float]] = {}  #: published results by method, for the foot of a table.
    subjects: Mapping[str, tuple[str, str, str]] = REAL  #: real meshes of a table, as ``REAL``.
    columns: tuple[MeasuredColumn, ...] = ()  #: means next to the errors, in the order of a table.

    def __init__(self, experiment: AnyExperiment) -> None:
        self.experiment = experiment

    @cached_property
    def settings(self) -> dict[str, Setting]:
        """Settings of the knobs by name."""
        knobs = self.experiment.own_knobs
        found: dict[str, Setting] = {DEFAULT: {knob.name: knob.default for knob in knobs}}
        for knob in knobs:
            for level in knob.levels:
                if level != knob.default:
                    found[f"{knob.name} = {level}"] = {**found[DEFAULT], knob.name: level}
        return found

    @property
    def methods(self) -> tuple[str, ...]:
        """Methods in the order of a table's rows."""
        return tuple(self.settings)

    @property
    def estimator(self) -> str:
        """Module whose sources, with all they import, decide whether a curve is current."""
        row = EXPERIMENTS.get(self.experiment.name)
        return __name__ if row is None else str(row.value).partition(":")[0]

    def cells(
        self, objects: Sequence[str], seeds: Sequence[int], chosen: Mapping[str, Sequence[str]]
    ) -> list[RunCell]:
        """List the runs, seed by seed, so that a stopped table has equally many of each object."""
        names = ("gap", *(condition.name for condition in self.conditions))
        return [
            self.cell(object=name, seed=seed, **dict(zip(names, levels, strict=True)))
            for seed in seeds
            for levels in product(*(chosen[name] for name in names))
            for name in objects
        ]

    def run_cell(
        self, cell: RunCell, scene: SceneFile, station: Station, recordings: Path | None = None
    ) -> JsonObject:
        """Perform a run, or open it in ``recordings``, and answer it by every method.

        Returns:
            ``rows`` by method, each with ``error_m`` and ``seconds``; a row may have ``error_symmetric_m``,
            ``in_region90``, ``refused``, and ``gross`` if an error above ``self.gross`` is no failure.
        """
        scene = cell.create_scene(scene)
        with open_run(self.experiment, cell, scene, station, recordings) as files:
            run = PlainRun(self.experiment, files, files.recording.committed)
            rows = {}
            for title, levels in self.settings.items():
                run.read(levels)
                solved = run.solve(levels)
                if solved.found is None:
                    raise FitRefused(solved.refusal)
                rows[title] = solved.found
            return {"schema": 1, "cell": vars(cell), self.experiment.plural: run.steps, "rows": rows}

    def list_answers(
        self,
        _thorough: bool,
        _chosen: Mapping[str, Sequence[str]],
        _scenes: Mapping[str, SceneFile],
        counts: Sequence[int],
    ) -> list[tuple[int, Setting]]:
        """List the answers of a run that a cost curve measures: number of steps, and setting.

        Args:
            thorough: whether every knob is varied.
            chosen: levels of the conditions, ``gap`` among them.
            scenes: scenes by object.
            counts: numbers of steps.
        """
        return [(count, setting) for count in counts for setting in self.settings.values()]

    def setting_name(self, setting: Setting) -> str:
        """Return the name of a setting, for the operator."""
        titles = (title for title, levels in self.settings.items() if levels == setting)
        return next(titles, "every knob at its finest level")

    def solver(self, files: RunFiles, _cell: RunCell | None = None) -> Solver:
        """Return a run's readings, to be answered at any setting.

        Args:
            files: folder of the run.
            cell: the run of a table or a cost curve; None for any other run.
        """
        return PlainRun(self.experiment, files, files.recording.committed)

    def notes(self) -> tuple[str, ...]:
        """Return sentences that a cost curve stores after its runs are answered."""
        return ()

    @property
    def finest(self) -> Setting:
        """Setting that is answered after a budget, to state the error with more time."""
        return {knob.name: knob.levels[-1] for knob in self.experiment.own_knobs}

    def shipped_curve(self) -> Curve | None:
        """Return the curve that came with the program; None if none did."""
        return None

    def condition(self, _scene: SceneFile) -> Mapping[str, Level]:
        """Return the condition of a scene's runs in a curve, without the number of steps."""
        return {"gap": "default"}

    def explain_refusal(self, _scene: SceneFile, setting: Setting) -> str | None:
        """State why a scene's runs cannot be answered at a setting of a stored curve; None if they can."""
        try:
            Accuracy(self.experiment.own_knobs, setting)
        except WrongUse as refusal:
            name = self.experiment.name
            return f"{refusal}; measure what accuracy costs again: touchstone cost {name}"
        return None

    def is_offered(self, _setting: Setting) -> bool:
        """State whether a budget may choose a setting if there are others."""
        return True


def measurement_of(experiment: AnyExperiment) -> Measurement:
    """Create the measurement of an experiment's cost curve and budgets."""
    return (experiment.measurement or Measurement)(experiment)


def table_of(experiment: AnyExperiment) -> Measurement:
    """Create the measurement of an experiment's table: the registry's if it names one, or its own."""
    row = EXPERIMENTS.get(experiment.name)
    if row is None or row.tables is None:
        return measurement_of(experiment)
    table: type[Measurement] = loaded(row.tables)
    return table(experiment)


def workers_of(number: int) -> AbstractContextManager[Executor | None]:
    """Create a context of a pool of processes; of None if this process computes everything."""
    return worker_pool(number) if number > 1 else nullcontext(None)


def dump_scenes(scenes: Mapping[str, SceneFile]) -> dict[str, JsonObject]:
    """Return scenes as JSON values for another process: a scene with an experiment's table has no pickle."""
    return {name: scene.model_dump(mode="json", by_alias=True) for name, scene in scenes.items()}


Result = TypeVar("Result")


def run_each(
    pool: Executor | None, function: Callable[[RunCell], Result], cells: Sequence[RunCell]
) -> Iterator[tuple[RunCell, Result]]:
    """Call a function for every run; yield each result as it is known.

    Args:
        pool: processes that call it; None for this one.
        function: the function; it can be pickled if there is a pool.
        cells: the runs.
    """
    if pool is None:
        for cell in cells:
            yield cell, function(cell)
        return
    running = {pool.submit(function, cell): cell for cell in cells}
    try:
        for done in as_completed(running):
            yield running[done], done.result()
    except BaseException:
        # The caller may remove a folder that the processes still write to.
        pool.shutdown(wait=True, cancel_futures=True)
        raise


@contextmanager
def perform_cells(
    name: str,
    cells: Sequence[RunCell],
    scenes: Mapping[str, SceneFile],
    station: Station,
    pool: Executor | None,
    report: Callable[[str], None],
) -> Iterator[dict[RunCell, RunFiles]]:
    """Perform runs in parallel if there is a pool; provide them until the context ends.

    Args:
        name: name of the experiment.
        cells: the runs.
        scenes: scenes by object.
        station: a mocked station.
        pool: processes that perform the runs; None for this one.
        report: function that receives the reason for each run that cannot be planned or performed.
    """
    with TemporaryDirectory(prefix="touchstone-runs-", ignore_cleanup_errors=True) as folder:
        trees = dump_scenes(scenes)
        perform = partial(_perform, name, trees, station, Path(folder))
        failed = {cell: why for cell, why in run_each(pool, perform, cells) if why is not None}
        for cell, why in failed.items():
            report(f"{cell.name} was not performed: {why}")
        yield {cell: RunFiles(Recording(Path(folder) / cell.name)) for cell in cells if cell not in failed}


def _perform(
    name: str, trees: Mapping[str, JsonObject], station: Station, folder: Path, cell: RunCell
) -> str | None:
    """Perform a run into a folder of recordings; return the reason if that is impossible."""
    scene = cell.create_scene(scene_from_json(trees[cell.object], "the cost of accuracy"))
    try:
        record_run(find_experiment(name), cell, scene, station, folder)
    except TouchstoneError as error:
        return str(error)
    return None
