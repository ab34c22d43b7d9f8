"""Runs of scale estimation in process, for tests."""

from pathlib import Path
from typing import Any

from experiments.scale_estimation.experiment import EXPERIMENT
from harness.bench.experiments import loaded
from harness.bench.scene import SceneFile, scene_from_json
from harness.bench.station import RunContext
from harness.bench.station_file import Station
from harness.effects.accuracy import Accuracy
from harness.experiment.answer import score
from harness.experiment.begin import begin
from harness.experiment.perform import perform_on
from harness.experiment.plain import IN_PROCESS
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.recording.session import Quiet


def scene_of(
    contacts: int, camera: bool = True, sound: bool = False, until: str | None = None, **thing: Any
) -> SceneFile:
    """A built-in object of hidden size; the mug where none is named."""
    return scene_from_json(
        {
            "schema": 1,
            "object": {"mesh": "builtin:mug", "scale": "hidden", **thing},
            "sensors": {"camera": camera, "touch": contacts > 0, "sound": sound},
            "scale": {"contacts": contacts, **({} if until is None else {"until": until})},
        },
        "the scene",
    )


def ran(folder: Path, scene: SceneFile, station: Station, seed: int = 3) -> Recording:
    """Planned and performed to its end."""
    recording = begin(EXPERIMENT, scene, station, seed, "unplaced", folder).recording
    assert went_on(recording, Quiet())
    return recording


def went_on(recording: Recording, progress: Quiet) -> bool:
    """Whether what was left of it is complete now."""
    run = RunFiles(recording)
    context = RunContext(recording.truth_path, run.mesh, recording.header.seed, "unplaced")
    bench = loaded(IN_PROCESS)(run.scene, run.station, context)
    return perform_on(EXPERIMENT, bench, recording, progress).complete


def answered(recording: Recording) -> dict[str, Any]:
    """Its result at the default levels."""
    return EXPERIMENT.result(score(EXPERIMENT, recording, Accuracy.default(EXPERIMENT.knobs)))
