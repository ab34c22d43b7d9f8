"""A contact over every wire, and the same in process: the same readings, to the wire's resolution.

The wire's resolution is where the arm stops once the force is met: the search goes on for as
long as two packets take to arrive and be acted on, some hundredths of a millimetre and more on
a busy machine. Of the same pose, both benches show the same picture to the bit.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from experiments.contact_localization.plan import plan_contacts
from harness.basics.arrays import FloatArray
from harness.basics.geometry import rotation_from_quaternion, transform
from harness.bench.device import Reading
from harness.bench.gap import load_gap
from harness.bench.scene import SceneFile
from harness.bench.station import Bench, RunContext, open_station
from harness.bench.station_file import Station
from harness.effects.scene_object import known_object
from harness.recording.step_file import Step
from harness.skills.planning import RunPlan
from harness.skills.press import PressPerformer, Speeds
from harness.twin.bench_of import way_between
from mocks.camera.gelsight_stream import encode
from mocks.in_process.bench import in_process_bench
from mocks.lab_scene import nominal_bench
from mocks.world.gap_draw import GapDraw
from mocks.world.world import World

SEED, GAP = 5, "default"
STEP = 3


@dataclass(frozen=True)
class Run:
    """What a contact read, and what was true of it."""

    readings: dict[str, Reading]
    truth: dict[str, Any]


def performed(bench: Bench, plan: RunPlan, truth: Path) -> Run:
    experiment = PressPerformer(
        lambda here, planned: way_between(plan.bench, here, planned), Speeds(travel=0.4)
    )
    step = Step(STEP, "press", plan.parameters()[0])
    read: Sequence[Reading] = experiment.perform(step, bench)
    return Run({reading.channel.name: reading for reading in read}, json.loads(truth.read_text()))


@pytest.fixture(scope="module")
def runs(scene: SceneFile, station: Station, tmp_path_factory: pytest.TempPathFactory) -> tuple[Run, Run]:
    """Over the wires, and in process."""
    mesh = known_object(scene).mesh
    plan = plan_contacts(scene, station, mesh, 1)
    folder = tmp_path_factory.mktemp("press")
    wired, simulated = folder / "wire.json", folder / "process.json"
    with open_station(station, scene, RunContext(wired, mesh, SEED, GAP)) as bench:
        over_wires = performed(bench, plan, wired)
    bench = in_process_bench(scene, station, RunContext(simulated, mesh, SEED, GAP))
    return over_wires, performed(bench, plan, simulated)


def pose_when_pictured(readings: dict[str, Reading]) -> FloatArray:
    poses, frames = readings["arm.base_from_flange"], readings["gel.image"]
    row = poses.values[np.searchsorted(poses.times, frames.times[0]) - 1]
    return transform(rotation_from_quaternion(row[3:]), row[:3])


def decoded(jpeg: bytes) -> FloatArray:
    return np.asarray(cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR), np.float64)


def test_both_benches_are_of_the_same_world(runs: tuple[Run, Run]) -> None:
    wire, process = runs
    assert wire.truth["differences"] == process.truth["differences"]
    assert wire.truth["base_from_object"] == process.truth["base_from_object"]


def test_the_truth_is_the_same_to_the_wires_resolution(runs: tuple[Run, Run]) -> None:
    (there,), (here,) = runs[0].truth["contacts"], runs[1].truth["contacts"]
    assert there["step"] == here["step"] == STEP
    assert there["point_in_object_m"] == pytest.approx(here["point_in_object_m"], abs=0.3e-3)
    # 50 ms late at 10 mm/s.
    assert there["penetration_m"] == pytest.approx(here["penetration_m"], abs=0.5e-3)
    assert there["penetration_m"] > 0.5e-3


def test_of_the_wires_pose_the_world_shows_the_wires_picture(
    runs: tuple[Run, Run], scene: SceneFile, station: Station
) -> None:
    mesh = known_object(scene).mesh
    world = World(
        nominal_bench(scene, station, None, scene.base_from_object(mesh), GapDraw(load_gap(GAP), SEED)),
        load_gap(GAP),
        SEED,
    )
    picture = world.tactile_image(pose_when_pictured(runs[0].readings), STEP, 0)
    received = runs[0].readings["gel.image"]
    assert len(set(received.encoded)) == 1
    # The controller states its pose as a rotation vector; a pixel may fall on the other side of a grey level.
    assert np.mean(decoded(encode(picture)) != decoded(received.encoded[0])) < 1e-2


def test_pictures_agree_as_far_as_the_depth_does(runs: tuple[Run, Run]) -> None:
    there, here = runs[0].readings, runs[1].readings
    assert set(there) == set(here)
    assert there["gel.image"].channel.shape == here["gel.image"].channel.shape
    difference = decoded(there["gel.image"].encoded[0]) - decoded(here["gel.image"].encoded[0])
    assert np.abs(difference).mean() < 6.0
