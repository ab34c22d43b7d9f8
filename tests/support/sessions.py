"""A localization begun, performed, answered and finished, as its command does it."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

from experiments.contact_localization.answer import ScoredContact
from experiments.contact_localization.experiment import EXPERIMENT
from harness.bench.device import Health
from harness.bench.scene import SceneFile
from harness.bench.station import Bench
from harness.bench.station_file import Station
from harness.effects.accuracy import Accuracy
from harness.experiment import answer, begin, perform
from harness.experiment.perform import Performed
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.recording.session import Progress
from harness.report.run_page import write_run_page


def start(
    scene: SceneFile, station: Station, seed: int, gap: str | None, folder: Path | None = None
) -> begin.Begun:
    """Plan and rehearse a run over the wires, and write it to the disk."""
    return begin.begin(EXPERIMENT, scene, station, seed, gap, folder, perform.WIRES)


def perform_on(bench: Bench, recording: Recording, progress: Progress) -> Performed:
    """What is left, on an open bench."""
    return perform.perform_on(EXPERIMENT, bench, RunFiles(recording), progress)


def perform_on_bench(recording: Recording, progress: Progress) -> Performed:
    """What is left, on the run's own bench."""
    return perform.perform_on_bench(EXPERIMENT, RunFiles(recording), progress)


def score(recording: Recording, accuracy: Accuracy) -> ScoredContact:
    """The answer, held against the truth."""
    return answer.score(EXPERIMENT, RunFiles(recording), accuracy)


def finish(
    recording: Recording,
    accuracy: Accuracy,
    health: Mapping[str, Health] | None,
    folder: Path | None = None,
) -> dict[str, Any]:
    """The result, with its report."""
    draw = partial(write_run_page, EXPERIMENT)
    return dict(answer.finish(EXPERIMENT, RunFiles(recording), accuracy, draw, health, folder))
