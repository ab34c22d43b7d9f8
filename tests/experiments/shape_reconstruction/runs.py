"""Runs of shape reconstruction in process, for tests."""

from pathlib import Path
from typing import Any

import numpy as np

from experiments.shape_reconstruction.experiment import EXPERIMENT
from experiments.shape_reconstruction.methods import QUICK
from experiments.shape_reconstruction.result import true_surface
from harness.basics.arrays import FloatArray
from harness.basics.faces.nearest_surface import NearestSurface
from harness.bench.experiments import loaded
from harness.bench.scene import SceneFile, scene_from_json
from harness.bench.station_file import Station
from harness.effects.accuracy import Accuracy
from harness.experiment.answer import score
from harness.experiment.begin import begin
from harness.experiment.perform import IN_PROCESS_BENCH, perform_on
from harness.experiment.truth import read_truth
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.recording.session import Quiet

QUICKLY = Accuracy.default(EXPERIMENT.knobs).with_({"shape.method": QUICK})


def scene_of(
    presses: int, choose: str, camera: bool = True, mesh: str = "builtin:mug", **more: Any
) -> SceneFile:
    """A built-in object; the mug where none is named."""
    return scene_from_json(
        {
            "schema": 1,
            "object": {"mesh": mesh},
            "sensors": {"camera": camera, "touch": presses > 0},
            "shape": {"presses": presses, "choose": choose, **more},
        },
        "the scene",
    )


def ran(folder: Path, scene: SceneFile, station: Station, seed: int = 0, gap: str = "default") -> Recording:
    """Planned and performed to its end."""
    recording = begin(EXPERIMENT, scene, station, seed, gap, folder).recording
    assert went_on(recording, Quiet())
    return recording


def went_on(recording: Recording, progress: Quiet) -> bool:
    """Whether what was left of it is complete now."""
    run = RunFiles(recording)
    bench = loaded(IN_PROCESS_BENCH)(run.scene, run.station, run.context)
    return perform_on(EXPERIMENT, bench, run, progress).complete


def answered(recording: Recording) -> dict[str, Any]:
    """Its result, by the quickest method, without what its seconds are."""
    found: dict[str, Any] = timeless(EXPERIMENT.result(score(EXPERIMENT, RunFiles(recording), QUICKLY)))
    return found


def timeless(result: Any) -> Any:
    """JSON values without those that are named seconds."""
    if not isinstance(result, dict):
        return result
    return {key: timeless(value) for key, value in result.items() if key != "seconds"}


def off_truth(recording: Recording, points: FloatArray) -> float:
    """M, root mean square distance of ``(n, 3)`` places in ``stand`` from the true surface."""
    return float(np.sqrt(np.mean(to_truth(recording, points) ** 2)))


def to_truth(recording: Recording, points: FloatArray) -> FloatArray:
    """``(n,)`` m from ``(n, 3)`` places in ``stand`` to the true surface."""
    truth = true_surface(RunFiles(recording), read_truth(recording))
    assert truth is not None
    return NearestSurface(truth).distances(points)
