"""A strike over every wire: the arm's output fires it, the box reads it, and in process it is the same."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from experiments.contact_localization.plan import plan_contacts
from experiments.contact_localization.section import Localization
from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.errors import BenchFault
from harness.basics.geometry import rotation_from_quaternion, transform
from harness.basics.mesh import Mesh
from harness.bench.acquisition import strike_from_readings
from harness.bench.acquisition_channels import CLOCK, FLAGS, FORCE, PRESSURE
from harness.bench.device import HAMMER, Reading
from harness.bench.named_files import SHIPPED
from harness.bench.scene import SceneFile, load_scene
from harness.bench.station import STRIKE, Bench, RunContext, open_station
from harness.bench.station_file import Station, load_station
from harness.effects.scene_object import known_object
from harness.recording.step_file import Step
from harness.skills.planning import RunPlan
from harness.skills.press import PressPerformer, Speeds
from harness.skills.strike import AFTER, BEFORE, POSE
from harness.twin.bench_of import way_between
from mocks.in_process.bench import in_process_bench

SEED, GAP, STEP = 5, "none", 3
RATE = 50e3

Readings = dict[str, Reading]


@pytest.fixture(scope="module")
def scene() -> SceneFile:
    read = load_scene(SHIPPED / "scenes" / "mug_both.toml")
    once = read.section(Localization).model_copy(update={"contacts": 1})
    return read.with_section(once)


@pytest.fixture(scope="module")
def station() -> Station:
    return load_station(SHIPPED / "stations" / "mock.toml")


@pytest.fixture(scope="module")
def mesh(scene: SceneFile) -> Mesh:
    return known_object(scene).mesh


@pytest.fixture(scope="module")
def plan(scene: SceneFile, station: Station, mesh: Mesh) -> RunPlan:
    return plan_contacts(scene, station, mesh, 1)


def performed(bench: Bench, plan: RunPlan) -> Readings:
    experiment = PressPerformer(
        lambda here, planned: way_between(plan.bench, here, planned), Speeds(travel=0.4)
    )
    read = experiment.perform(Step(STEP, "press", plan.parameters()[0]), bench)
    return {reading.channel.name: reading for reading in read}


def capture(bench: Bench, fire: Callable[[], None], timeout: float = 1.0) -> Readings:
    try:
        read = bench.get(HAMMER).capture(fire, BEFORE, AFTER, timeout)
    except BenchFault:  # a busy machine lost samples, and said so
        read = bench.get(HAMMER).capture(fire, BEFORE, AFTER, timeout)
    return {reading.channel.name: reading for reading in read}


def switch(bench: Bench, output: int) -> None:
    bench.arm.set_digital_output(output, True)
    bench.arm.set_digital_output(output, False)


@pytest.fixture(scope="module")
def wired(
    scene: SceneFile, station: Station, mesh: Mesh, plan: RunPlan, tmp_path_factory: pytest.TempPathFactory
) -> dict[str, Any]:
    """A contact with its strike over the wires; then firings that strike nothing."""
    truth = tmp_path_factory.mktemp("strike") / "wire.json"
    with open_station(station, scene, RunContext(truth, mesh, SEED, GAP)) as bench:
        contact = performed(bench, plan)
        nobody = capture(bench, lambda: None, 0.3)
        other = capture(bench, lambda: switch(bench, 1), 0.3)
        missed = capture(bench, lambda: switch(bench, 0), 0.3)
        health = bench.get(HAMMER).health()
    told = json.loads(truth.read_text(encoding="utf-8"))
    return {
        "contact": contact,
        "silent": (nobody, other, missed),
        "health": health,
        "truth": told["contacts"][0],
    }


def counts(readings: Readings, name: str) -> AnyArray:
    return readings[name].values.ravel()


def pose_of(readings: Readings) -> FloatArray:
    row = readings[POSE].values[0]
    return transform(rotation_from_quaternion(row[3:]), row[:3])


def test_the_strike_of_the_wire_is_the_one_that_the_world_makes_of_that_pose(
    wired: dict[str, Any], scene: SceneFile, station: Station, mesh: Mesh, plan: RunPlan, tmp_path: Path
) -> None:
    bench = in_process_bench(scene, station, RunContext(tmp_path / "t.json", mesh, SEED, GAP))
    there = wired["contact"]
    strikes = vars(bench.get(HAMMER))["_strikes"]
    record = strikes.record(pose_of(there), STEP, STRIKE).astype(np.int64)
    force, pressure = counts(there, FORCE), counts(there, PRESSURE)
    level = np.median(record[:900, 0]) + 147
    first = int(np.argmax(record[:, 0] >= level)) - round(BEFORE * RATE)
    window = record[first : first + len(force)]
    np.testing.assert_array_equal(force, window[:, 0])
    # The controller states its pose as a rotation vector: a sample may fall on the other side of a count.
    assert np.abs(pressure - window[:, 1]).max() <= 1
    assert np.mean(pressure != window[:, 1]) < 1e-2


def test_in_process_the_same_contact_reads_alike(
    wired: dict[str, Any], scene: SceneFile, station: Station, mesh: Mesh, plan: RunPlan, tmp_path: Path
) -> None:
    bench = in_process_bench(scene, station, RunContext(tmp_path / "t.json", mesh, SEED, GAP))
    there, here = wired["contact"], performed(bench, plan)
    assert set(there) == set(here)
    for name in (FORCE, PRESSURE, CLOCK, FLAGS):
        assert there[name].channel.dtype == here[name].channel.dtype
        assert there[name].channel.shape == here[name].channel.shape
    np.testing.assert_array_equal(there[FLAGS].values, here[FLAGS].values)
    np.testing.assert_array_equal(counts(there, FORCE), counts(here, FORCE))
    assert station.hammer is not None
    strikes = [strike_from_readings(readings, station.hammer.acquisition) for readings in (there, here)]
    assert strikes[0].onset == strikes[1].onset
    assert strikes[0].rate == pytest.approx(RATE, rel=1e-3)  # fitted over a few seconds of a busy machine
    assert strikes[1].rate == pytest.approx(RATE, rel=1e-9)
    difference = strikes[0].pressure - strikes[1].pressure
    assert difference.std() < 0.1 * strikes[1].pressure.std()  # the press came to rest a little elsewhere


def test_the_strike_is_where_the_press_was(wired: dict[str, Any]) -> None:
    truth = wired["truth"]
    apart = np.subtract(truth["strike"]["point_in_object_m"], truth["point_in_object_m"])
    assert np.linalg.norm(apart) < 0.2e-3
    assert truth["step"] == STEP


def test_without_a_blow_the_box_says_so(wired: dict[str, Any]) -> None:
    for readings in wired["silent"]:
        assert readings[FLAGS].values[0][3] == 1.0
        assert np.ptp(counts(readings, FORCE)) < 10


def test_the_box_says_how_it_does(wired: dict[str, Any]) -> None:
    assert wired["health"].rate == pytest.approx(RATE, rel=1e-3)
    assert "mock-2108" in wired["health"].identity
