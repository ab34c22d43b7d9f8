"""Tables and cost curves of an experiment that has no way of its own: runs in process, all dials turned."""

import time
from collections.abc import Iterator, Mapping, MutableMapping, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from harness.basics.errors import TouchstoneError
from harness.bench.experiments import EXPERIMENTS, loaded
from harness.bench.scene import SceneFile
from harness.bench.station import RunContext
from harness.bench.station_file import Station
from harness.cost.curve import Sample
from harness.effects.accuracy import Accuracy, Knob, Level
from harness.experiment.begin import begin
from harness.experiment.experiment import Experiment, Measurement, Say, Scored, Setting
from harness.experiment.lookup import named
from harness.experiment.perform import perform_on
from harness.experiment.truth import read_truth
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.recording.step_file import Step

IN_PROCESS = "mocks.in_process.bench:in_process_bench"
"""The mocked bench without sockets, in simulated time."""

DEFAULT = "default"
"""The method, and the setting, of every dial at its default."""


@dataclass(frozen=True)
class Answered:
    """An answer that is one number.

    Attributes:
        value: in the experiment's own unit.
        seconds: that it took.
    """

    value: float
    seconds: float


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
class PlainCase:
    """A performed run, to be answered at any setting of the dials."""

    cell: PlainCell
    experiment: Experiment
    recording: Recording
    kept: TemporaryDirectory[str] = field(repr=False)

    @property
    def steps(self) -> int:
        """How many were performed."""
        return self.recording.committed

    def close(self) -> None:
        """Remove the run's folder."""
        self.kept.cleanup()

    def result(self, setting: Setting, steps: int) -> tuple[dict[str, Any], float, float]:
        """The answer from the first steps as JSON values, its s of CPU time and on the clock."""
        run = RunFiles(self.recording)
        accuracy = Accuracy.default(self.experiment.knobs).with_(setting)
        answering = self.experiment.answering(run, accuracy)
        records = [record for record in self.recording.steps() if record.step.index < steps]
        cpu, wall = time.process_time(), time.perf_counter()
        for record in records:
            answering.read(record)
        found = answering.answer()
        taken = time.process_time() - cpu, time.perf_counter() - wall
        truth = read_truth(self.recording)
        if truth is not None:
            truth = replace(truth, points={k: v for k, v in truth.points.items() if k < steps})
        scored = Scored(run, answering, found, truth, accuracy, ())
        return self.experiment.result(scored), *taken

    def sample(self, setting: Setting, steps: int) -> Sample:
        """The error and the seconds of an answer from the first steps."""
        self.result(setting, steps)  # what is compiled for it is loaded
        found, cpu, wall = self.result(setting, steps)
        return Sample(self.cell.name, self.cell.object, found["error_m"], None, 0.0, cpu, wall, float(steps))


def plain_measurement(name: str, *knobs: Knob[Level]) -> Measurement:
    """How an experiment is measured by its dials alone.

    Args:
        name: of the experiment, as in the table of experiments.
        knobs: turned one at a time from their defaults.
    """
    settings: dict[str, Setting] = {DEFAULT: {knob.name: knob.default for knob in knobs}}
    for knob in knobs:
        for level in knob.levels:
            if level != knob.default:
                settings[f"{knob.name} = {level}"] = {**settings[DEFAULT], knob.name: level}
    return Measurement(
        estimator=str(EXPERIMENTS[name].value).partition(":")[0] if name in EXPERIMENTS else __name__,
        conditions=(),
        cells=_cells,
        run_cell=_Answers(name, settings),
        methods=tuple(settings),
        performed=_Performs(name),
        settings=lambda _thorough, _chosen, _scenes: tuple(settings.values()),
        setting_name=lambda setting: next(n for n, levels in settings.items() if levels == setting),
    )


def _cells(
    objects: Sequence[str], seeds: Sequence[int], chosen: Mapping[str, Sequence[str]]
) -> list[PlainCell]:
    return [PlainCell(name, gap, seed) for seed in seeds for gap in chosen["gap"] for name in objects]


@dataclass(frozen=True)
class _Answers:
    """Performs a run in process and answers it at every setting."""

    name: str
    settings: Mapping[str, Setting]

    def __call__(self, cell: PlainCell, scene: SceneFile, station: Station) -> dict[str, Any]:
        with _performed(named(self.name), cell, scene, station) as case:
            found = {name: case.result(levels, case.steps)[0] for name, levels in self.settings.items()}
            return {"schema": 1, "cell": vars(cell), case.experiment.plural: case.steps, "rows": found}


@dataclass(frozen=True)
class _Performs:
    """Performs the runs of a cost curve, one after the other."""

    name: str

    def __call__(
        self,
        cells: Sequence[Any],
        scenes: Mapping[str, SceneFile],
        station: Station,
        pool: Executor | None,
        models: MutableMapping[str, Any],
        say: Say,
    ) -> dict[Any, Any]:
        del pool, models  # runs are few, and no model outlives its run
        found = {}
        for cell in cells:
            try:
                found[cell] = perform_in_process(named(self.name), cell, scenes[cell.object], station)
            except TouchstoneError as error:
                say(f"{cell.name} was not performed: {error}")
        return found


def perform_in_process(
    experiment: Experiment, cell: PlainCell, scene: SceneFile, station: Station
) -> PlainCase:
    """Plan, rehearse and perform a run on the mocked bench in process; its folder goes with the case."""
    kept = TemporaryDirectory(prefix="touchstone-case-")
    recording = begin(experiment, scene, station, cell.seed, cell.gap, Path(kept.name) / "run").recording
    run = RunFiles(recording)
    context = RunContext(recording.truth_path, run.mesh, cell.seed, cell.gap)
    perform_on(experiment, loaded(IN_PROCESS)(run.scene, run.station, context), recording, _Quiet())
    return PlainCase(cell, experiment, recording, kept)


@contextmanager
def _performed(
    experiment: Experiment, cell: PlainCell, scene: SceneFile, station: Station
) -> Iterator[PlainCase]:
    case = perform_in_process(experiment, cell, scene, station)
    try:
        yield case
    finally:
        case.close()


class _Quiet:
    """A progress that says nothing."""

    def began(self, step: Step) -> None:
        """Nothing."""

    def ended(self, step: Step, seconds: float) -> None:
        """Nothing."""
