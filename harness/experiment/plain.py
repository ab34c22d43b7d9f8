"""Tables and cost curves of an experiment that has no way of its own: runs in process, all dials turned."""

import time
from collections.abc import Callable, Mapping, MutableMapping, Sequence
from concurrent.futures import Executor
from contextlib import closing
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TypeVar

from harness.basics.errors import FitRefused, TouchstoneError, WrongUse
from harness.basics.files.json_file import JsonObject
from harness.bench.experiments import EXPERIMENTS
from harness.bench.scene import SceneFile
from harness.bench.station_file import Station
from harness.cost.curve import Sample
from harness.effects.accuracy import Accuracy, Knob, Level, Setting
from harness.experiment.experiment import (
    Answering,
    AnyExperiment,
    Measurement,
    RunCase,
    RunCell,
    Say,
    Scored,
)
from harness.experiment.in_process import performed, recorded
from harness.experiment.levels import chosen_levels
from harness.experiment.lookup import named
from harness.experiment.solving import Budgets, Solved
from harness.experiment.subjects import object_key
from harness.experiment.truth import read_truth
from harness.recording.run_folder import RunFiles
from harness.recording.step_file import StepRecord

TICK = 1.0e-6
"""CPU time in s of an answer that is quicker than the clock of CPU time can measure."""

DEFAULT = "default"
"""The method, and the setting, of every dial at its default."""


@dataclass(frozen=True)
class PlainCell:
    """Which run: nothing is varied but the reality gap."""

    object: str
    gap: str
    seed: int

    @property
    def name(self) -> str:
        """Of the run's file; a gap may be a path."""
        return f"{self.object}-{self.gap.replace('/', '_')}-{self.seed}"

    @property
    def conditions(self) -> dict[str, str]:
        """What was varied."""
        return {"gap": self.gap}


@dataclass(frozen=True, eq=False)
class PlainRun:
    """A recorded run, to be answered at any setting of the knobs; settings share the inverted pictures."""

    experiment: AnyExperiment  #: the experiment of the run.
    files: RunFiles  #: folder of the run.
    steps: int  #: number of its first steps that are used.
    shared: tuple[float, float] = (0.0, 0.0)  #: CPU and wall time in s that reading the pictures took.

    @property
    def object(self) -> str:
        """The name that its seconds are measured under."""
        return object_key(self.files.scene.object.name, self.files.mesh)

    @property
    def records(self) -> list[StepRecord]:
        """The steps that are used."""
        return [record for record in self.files.recording.steps() if record.step.index < self.steps]

    def unfit(self, _setting: Setting) -> None:
        """It can be answered at every setting."""

    def prepare(self, setting: Setting) -> None:
        """Make the readings once: an experiment then makes and loads what it needs."""
        self._answering(setting)

    def prepared_alike(self, _one: Setting, _other: Setting) -> bool:
        """Always."""
        return True

    def work(self, _setting: Setting) -> float:
        """As many steps as there are."""
        return float(self.steps)

    def read(self, _setting: Setting) -> "PlainRun":
        """Invert the pictures that were not inverted yet."""
        seen = [self.files.observe(record) for record in self.records if "gel.image" in record.readings]
        seconds = [self.files.gel_reader.read(one.images).seconds for one in seen]
        return replace(self, shared=(sum(cpu for cpu, _ in seconds), sum(wall for _, wall in seconds)))

    def result(self, setting: Setting) -> JsonObject:
        """Return the answer as JSON values.

        Raises:
            FitRefused: nothing explains the readings.
        """
        solved = self.solve(self.read(setting), setting)
        if solved.found is None:
            raise FitRefused(solved.refusal)
        return solved.found

    def solve(self, _readings: "PlainRun", setting: Setting) -> Solved[JsonObject]:
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
        return Solved(result, result.get("credible90_m"), cpu, wall)

    def _answering(self, setting: Setting) -> tuple[Accuracy, Answering]:
        accuracy = chosen_levels(self.experiment.knobs, (), self.files.network_levels).with_(setting)
        return accuracy, self.experiment.answering(self.files, accuracy)

    def described(self, solved: Solved[JsonObject]) -> JsonObject:
        """Where its answer is a place, that; its error."""
        found = solved.found or {}
        return {
            "position_m": found.get("position_m"),
            "error_m": found.get("error_m"),
            "refused": solved.refusal,
        }


@dataclass(frozen=True, eq=False)
class PlainCase:
    """A performed run, to be answered at any setting of the dials."""

    cell: RunCell
    run: PlainRun
    aside: TemporaryDirectory[str] | None = field(default=None, repr=False)

    @property
    def steps(self) -> int:
        """How many were performed."""
        return self.run.steps

    def close(self) -> None:
        """Remove the run's folder, where it is not one of recordings."""
        if self.aside is not None:
            self.aside.cleanup()

    def sample(self, setting: Setting, steps: int) -> Sample:
        """The error and the seconds of an answer from the first steps."""
        run = replace(self.run, steps=steps).read(setting)
        solved, work = run.solve(run, setting), run.work(setting)
        if solved.found is None:
            raise FitRefused(solved.refusal)
        numbers = run.shared[0], solved.cpu, solved.wall, work
        return Sample(self.cell.name, run.object, solved.found["error_m"], solved.radius, *numbers)


Cell = TypeVar("Cell", bound=RunCell)


def plain_measurement(name: str, *knobs: Knob[Level]) -> Measurement[PlainCell, object]:
    """Measure an experiment in runs that differ in object, gap and seed alone; see ``measure_by_knobs``."""

    def cells(
        objects: Sequence[str], seeds: Sequence[int], chosen: Mapping[str, Sequence[str]]
    ) -> list[PlainCell]:
        return [PlainCell(name, gap, seed) for seed in seeds for gap in chosen["gap"] for name in objects]

    return measure_by_knobs(name, cells, lambda scene, _: scene, *knobs)


def measure_by_knobs(
    name: str,
    cells: Callable[[Sequence[str], Sequence[int], Mapping[str, Sequence[str]]], Sequence[Cell]],
    scene_of: Callable[[SceneFile, Cell], SceneFile],
    *knobs: Knob[Level],
) -> Measurement[Cell, object]:
    """Measure an experiment by its knobs alone.

    Args:
        name: name of the experiment in the table of experiments.
        cells: creates the runs of so many objects, seeds and levels of the conditions.
        scene_of: creates the scene of a run from that of its object.
        knobs: knobs that are changed one at a time from their defaults.
    """
    settings: dict[str, Setting] = {DEFAULT: {knob.name: knob.default for knob in knobs}}
    for knob in knobs:
        for level in knob.levels:
            if level != knob.default:
                settings[f"{knob.name} = {level}"] = {**settings[DEFAULT], knob.name: level}

    def answer_cell(
        cell: Cell, scene: SceneFile, station: Station, recordings: Path | None = None
    ) -> JsonObject:
        scene = scene_of(scene, cell)
        with closing(perform_in_process(named(name), cell, scene, station, recordings)) as case:
            run = case.run
            rows = {title: run.result(levels) for title, levels in settings.items()}
            return {"schema": 1, "cell": vars(cell), run.experiment.plural: run.steps, "rows": rows}

    def perform_cells(
        cells: Sequence[Cell],
        scenes: Mapping[str, SceneFile],
        station: Station,
        _pool: Executor | None,
        _models: MutableMapping[str, object],
        say: Say,
    ) -> dict[Cell, RunCase]:
        found: dict[Cell, RunCase] = {}
        for cell in cells:
            try:
                scene = scene_of(scenes[cell.object], cell)
                found[cell] = perform_in_process(named(name), cell, scene, station)
            except TouchstoneError as error:
                say(f"{cell.name} was not performed: {error}")
        return found

    return Measurement(
        estimator=str(EXPERIMENTS[name].value).partition(":")[0] if name in EXPERIMENTS else __name__,
        conditions=(),
        cells=cells,
        run_cell=answer_cell,
        methods=tuple(settings),
        performed=perform_cells,
        settings=lambda _thorough, _chosen, _scenes: tuple(settings.values()),
        setting_name=lambda setting: next(
            (title for title, levels in settings.items() if levels == setting), "every dial at its finest"
        ),
    )


def plain_budgets(
    name: str, steps: Callable[[SceneFile], int], *knobs: Knob[Level]
) -> Budgets[PlainRun, JsonObject]:
    """How an experiment keeps a budget by its dials alone; errors are promised where it has ``credible90_m``.

    Args:
        name: of the experiment, as in the table of experiments.
        steps: that a run of a scene has.
        knobs: all at their finest for what more time would have given.
    """

    def solver(run: RunFiles) -> PlainRun:
        return PlainRun(named(name), run, run.recording.committed)

    def unfit(_scene: SceneFile, setting: Setting) -> str | None:
        """Return why a setting of a stored curve cannot be answered; None if it can."""
        try:
            Accuracy(knobs, setting)
        except WrongUse as refusal:
            return f"{refusal}; measure what accuracy costs again: touchstone cost {name}"
        return None

    return Budgets(solver, {knob.name: knob.levels[-1] for knob in knobs}, steps, unfit=unfit)


def perform_in_process(
    experiment: AnyExperiment,
    cell: RunCell,
    scene: SceneFile,
    station: Station,
    recordings: Path | None = None,
) -> PlainCase:
    """Plan, rehearse and perform a run on the mocked bench in process.

    Args:
        experiment: which.
        cell: of a table or a cost curve.
        scene: on the table.
        station: the bench.
        recordings: folder that keeps its run, and where it lies if it was performed before; None for a run
            whose folder goes with the case.
    """
    if recordings is not None:
        recording = recorded(experiment, cell, scene, station, recordings)
        return PlainCase(cell, PlainRun(experiment, RunFiles(recording), recording.committed))
    aside = TemporaryDirectory(prefix="touchstone-case-")
    recording = performed(experiment, cell, scene, station, Path(aside.name) / "run")
    return PlainCase(cell, PlainRun(experiment, RunFiles(recording), recording.committed), aside)
