"""Runs of scale estimation in process, for tests."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull

from experiments.scale_estimation.answer import KNOBS, ScaleAnswering
from experiments.scale_estimation.experiment import EXPERIMENT
from harness.basics.arrays import FloatArray
from harness.basics.geometry import apply
from harness.basics.mesh import Mesh
from harness.bench.experiments import loaded
from harness.bench.scene import SceneFile, scene_from_json
from harness.bench.station_file import Station
from harness.effects.accuracy import Accuracy
from harness.experiment.answer import score
from harness.experiment.begin import begin
from harness.experiment.perform import IN_PROCESS_BENCH, perform_on
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.recording.session import Quiet
from harness.twin.rehearsal import Segment


def scene_of(
    contacts: int,
    camera: bool = True,
    sound: bool = False,
    until: str | None = None,
    shape: str = "known",
    **thing: Any,
) -> SceneFile:
    """A built-in object of hidden size; the mug where none is named."""
    return scene_from_json(
        {
            "schema": 1,
            "object": {"mesh": "builtin:mug", "scale": "hidden", **thing},
            "sensors": {"camera": camera, "touch": contacts > 0, "sound": sound},
            "scale": {"contacts": contacts, "shape": shape, **({} if until is None else {"until": until})},
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
    bench = loaded(IN_PROCESS_BENCH)(run.scene, run.station, run.context)
    return perform_on(EXPERIMENT, bench, run, progress).complete


def answered(recording: Recording) -> dict[str, Any]:
    """Its result at the default levels."""
    return dict(EXPERIMENT.result(score(EXPERIMENT, RunFiles(recording), Accuracy.default(EXPERIMENT.knobs))))


def answering_of(recording: Recording) -> ScaleAnswering:
    """All of its readings, taken in."""
    answering = ScaleAnswering(RunFiles(recording), Accuracy.default(KNOBS))
    for record in recording.steps():
        answering.read(record)
    return answering


def true_mesh(recording: Recording) -> Mesh:
    """The true object as it stands, in base."""
    truth = json.loads(recording.truth_path.read_text())
    mesh = RunFiles(recording).mesh
    nominal = float(np.ptp(mesh.bounds, axis=0).max())
    size = truth["differences"]["longest_side_m"] / nominal
    return Mesh(apply(np.array(truth["base_from_object"]), mesh.vertices * size), mesh.faces)


def outside(recording: Recording, space: Mesh) -> float:
    """M by which the true object, as it stands in base, leaves a convex space."""
    places = true_mesh(recording).vertices
    low = RunFiles(recording).scene.object.pose.position[2]
    above = places[places[:, 2] > low + 2e-3]
    sides = ConvexHull(space.vertices).equations
    return float((above @ sides[:, :3].T + sides[:, 3]).max())


def travels(recording: Recording) -> Iterator[Segment]:
    """Every joint motion of its contacts, as it was planned."""
    for record in recording.steps():
        parameters = record.step.parameters
        if record.step.kind == "press":
            here: FloatArray = np.array(parameters["start_rad"])
            for there in np.array(parameters["travel_rad"]).reshape(-1, 6):
                yield Segment(record.step.index, "travel", "joint", here, there)
                here = there
