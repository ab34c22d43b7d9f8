"""Whole runs for tests: a run folder made on the bench in process, and copies of it to tamper with."""

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from harness.basics.arrays import ByteArray
from harness.basics.files.json_file import CHECKSUM, checksum_of
from harness.bench.scene import SceneFile, scene_from_json
from harness.bench.station_file import load_station, station_path
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.recording.session import Quiet
from harness.recording.step_file import StepRecord, write_step
from mocks.in_process.bench import in_process_bench
from tests.support import sessions as session_of


def touch_scene(mesh: str = "builtin:mug", contacts: int = 3, spacing: str = "spread") -> SceneFile:
    """A scene of which only the touch matters."""
    tree = {
        "schema": 1,
        "object": {"mesh": mesh, "material": "ceramic"},
        "localization": {"contacts": contacts, "spacing": spacing},
    }
    return scene_from_json(tree, "the test")


def in_process_run(
    folder: Path, scene: SceneFile, seed: int, gap: str = "default", station: str = "mock"
) -> Recording:
    """Plan, rehearse and perform a run without sockets, in simulated time; nothing is estimated."""
    started = session_of.start(scene, load_station(station_path(station)), seed, gap, folder)
    recording = started.recording
    run = RunFiles(recording)
    bench = in_process_bench(run.scene, run.station, run.context)
    complete = session_of.perform_on(bench, recording, Quiet()).complete
    assert complete
    return recording


def copied(recording: Recording, folder: Path, truth: bool = True) -> Recording:
    """The run under another name, with its truth beside it or without."""
    shutil.copytree(recording.folder, folder)
    copy = Recording(folder)
    if truth:
        shutil.copy(recording.truth_path, copy.truth_path)
    return copy


def edited(recording: Recording, change: Callable[[dict[str, Any]], None]) -> Recording:
    """The run with its ``run.json`` changed in place."""
    path = recording.folder / "run.json"
    tree = json.loads(path.read_text())
    change(tree)
    path.write_text(json.dumps({**tree, CHECKSUM: checksum_of(tree)}))
    return Recording(recording.folder)


def rewritten(recording: Recording, change: Callable[[StepRecord], StepRecord]) -> Recording:
    """The run with every step changed in place."""
    for record in recording.steps():
        path = recording.folder / "steps" / f"{record.step.index:03d}.mcap"
        write_step(path, change(record), recording.header.clock_offset_ns)
    return Recording(recording.folder)


def with_reading(record: StepRecord, name: str, change: Callable[[Any], Any]) -> StepRecord:
    """The step with the values of one reading changed; ``change`` gets a copy it may write to."""
    reading = record.readings[name]
    changed = replace(reading, values=change(reading.values.copy()))
    return replace(record, readings={**record.readings, name: changed})


SPOILED: dict[str, Callable[[ByteArray], ByteArray]] = {
    "mirrored": lambda frames: frames[:, :, ::-1],
    "channels exchanged": lambda frames: frames[..., ::-1],
    "black": np.zeros_like,
}
"""``(n, rows, columns, 3)`` frames of a press that are not what the gel's calibration was made of."""


def with_spoiled_pictures(recording: Recording, folder: Path, how: str, *steps: int) -> Recording:
    """A copy of the run, the gel's pictures of some steps spoiled."""

    def change(record: StepRecord) -> StepRecord:
        if record.step.index not in steps:
            return record
        reading = record.readings["gel.image"]
        frames = np.ascontiguousarray(SPOILED[how](np.asarray(reading.values)))
        spoiled = replace(reading, values=frames, encoded=tuple(_jpeg(frame) for frame in frames))
        return replace(record, readings={**record.readings, "gel.image": spoiled})

    return rewritten(copied(recording, folder), change)


def _jpeg(frame: ByteArray) -> bytes:
    """As a camera sends an RGB frame."""
    return bytes(cv2.imencode(".jpg", cv2.cvtColor(frame, cv2.COLOR_RGB2BGR))[1])
