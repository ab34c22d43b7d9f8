"""The bench in simulated time: it obeys the same protocols, and time is only arithmetic."""

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from harness.basics.arrays import FloatArray
from harness.basics.errors import BenchFault, LimitExceeded
from harness.basics.geometry import translation
from harness.bench.device import Arm, TactileCamera
from harness.bench.gap import load_gap
from harness.bench.kinematics import forward, nearest_branch
from mocks.camera.gelsight_stream import encode
from mocks.in_process.arm import CYCLE, NOTICED_AFTER, InProcessArm, Stage
from mocks.in_process.bench import InProcessCamera
from mocks.lab import TruthFile
from mocks.ur.hooks import HOME
from mocks.world.world import NominalBench, World

Press = Callable[[float, float, float], FloatArray]
FORCE, SPEED, STAND_OFF = 0.4, 0.01, 0.02
FRONT, HEIGHT = 1.0, 0.05  # on the side that the arm stands on, beside the handle
RANGE = np.array([[-2 * np.pi] * 6, [2 * np.pi] * 6])


@pytest.fixture(scope="module")
def world(mug_bench: NominalBench) -> World:
    return World(mug_bench, load_gap("default"), 5)


class Bench:
    """An arm at a stand-off before the mug's wall, and the gel on it."""

    def __init__(self, world: World, press: Press) -> None:
        self.stage = Stage()
        self.start = press(-STAND_OFF, FRONT, HEIGHT)
        joints = nearest_branch("ur5e", self.start, np.array(HOME), RANGE)
        assert joints is not None
        self.arm = InProcessArm("ur5e", joints, world, self.stage)
        self.gel = InProcessCamera(
            "gel",
            world.sensor.name,
            (world.sensor.rows, world.sensor.columns),
            world.tactile_image,
            self.arm,
            self.stage,
        )
        self.stage.step = 0
        self.axis = self.start[:3, 2].copy()


@pytest.fixture
def bench(world: World, press: Press) -> Bench:
    return Bench(world, press)


def test_both_are_the_instruments_an_experiment_asks_for(bench: Bench) -> None:
    arm: Arm = bench.arm
    gel: TactileCamera = bench.gel
    for instrument in (arm, gel):
        instrument.open()
        assert instrument.health().drops == 0
        instrument.close()
    arm.stop()


def test_a_search_ends_a_moment_after_the_force_is_met(bench: Bench, world: World) -> None:
    bench.arm.zero_force()
    assert bench.arm.move_until_contact(bench.axis, SPEED, FORCE, 0.04)
    touched = bench.arm.state()
    assert abs(touched.wrench[:3] @ bench.axis) >= FORCE
    before = touched.base_from_flange.copy()
    before[:3, 3] -= (NOTICED_AFTER + 1) * SPEED * CYCLE * bench.axis
    assert abs(world.contact_wrench(before, 0)[:3] @ bench.axis) < FORCE
    assert np.linalg.norm(np.cross(touched.base_from_flange[:3, 3] - bench.start[:3, 3], bench.axis)) < 1e-9


def test_a_search_takes_its_time(bench: Bench) -> None:
    assert bench.arm.move_until_contact(bench.axis, SPEED, FORCE, 0.04)
    way = np.linalg.norm(bench.arm.state().base_from_flange[:3, 3] - bench.start[:3, 3])
    assert bench.stage.time == pytest.approx(way / SPEED, rel=1e-6)


def test_a_search_that_meets_nothing_says_so_at_its_end(bench: Bench) -> None:
    assert not bench.arm.move_until_contact(-bench.axis, SPEED, FORCE, 0.03)
    moved = bench.arm.state().base_from_flange[:3, 3] - bench.start[:3, 3]
    assert moved == pytest.approx(-0.03 * bench.axis, abs=1e-9)


def test_a_line_is_straight_and_ends_where_it_should(bench: Bench) -> None:
    goal = bench.start @ translation(np.array([0.0, 0.03, -0.05]))
    bench.arm.move_line(goal, 0.1, 0.5)
    assert bench.arm.state().base_from_flange == pytest.approx(goal, abs=1e-9)
    poses = bench.arm.history(bench.stage.time)[1].values
    along = (goal - bench.start)[:3, 3]
    sideways = np.cross(poses[:, :3] - bench.start[:3, 3], along / np.linalg.norm(along))
    assert np.abs(sideways).max() < 1e-9
    assert np.all(np.diff((poses[:, :3] - bench.start[:3, 3]) @ along) >= -1e-12)


def test_the_history_is_at_the_stated_rate_and_true_to_the_kinematics(bench: Bench) -> None:
    bench.arm.move_joints(np.array(HOME), 0.9, 1.2)
    bench.stage.pause(0.5)
    joints, poses, wrenches, clock = bench.arm.history(1.0)
    assert [r.channel.name for r in (joints, poses, wrenches, clock)] == [
        "arm.joints",
        "arm.base_from_flange",
        "arm.wrench",
        "arm.controller_time",
    ]
    assert len(joints.times) in (125, 126)
    assert np.diff(joints.times) == pytest.approx(1 / 125)
    assert forward("ur5e", joints.values)[:, :3, 3] == pytest.approx(poses.values[:, :3], abs=1e-12)
    assert np.array_equal(joints.values[-1], np.array(HOME))
    assert len(bench.arm.history(1e-6)[0].times) == 1


def test_the_gel_sends_what_the_world_shows(bench: Bench, world: World) -> None:
    assert bench.arm.move_until_contact(bench.axis, SPEED, FORCE, 0.04)
    goal = bench.arm.state().base_from_flange @ translation(np.array([0.0, 0.0, 1e-3]))
    bench.arm.move_line(goal, 5e-3, 0.2)
    bench.stage.sample = 0
    asked = bench.stage.time
    reading = bench.gel.read(3, 1.0)
    picture = world.tactile_image(bench.arm.state().base_from_flange, 0, 0)
    assert np.abs(picture.astype(int) - world.background).max() > 20
    assert reading.encoded == (encode(picture),) * 3
    decoded = cv2.imdecode(np.frombuffer(reading.encoded[0], np.uint8), cv2.IMREAD_COLOR)
    assert decoded is not None
    assert np.array_equal(reading.values[0], decoded[..., ::-1])
    assert np.all(reading.times > asked)
    assert np.diff(reading.times) == pytest.approx(0.04)
    assert bench.stage.time == reading.times[-1]


def test_a_rerun_reads_the_same_to_the_bit(world: World, press: Press) -> None:
    def run() -> tuple[bytes, FloatArray]:
        bench = Bench(world, press)
        assert bench.arm.move_until_contact(bench.axis, SPEED, FORCE, 0.04)
        return bench.gel.read(1, 1.0).encoded[0], bench.arm.state().base_from_flange

    (first, here), (second, there) = run(), run()
    assert first == second
    assert np.array_equal(here, there)


def test_frames_that_take_longer_than_allowed_are_a_fault(bench: Bench) -> None:
    with pytest.raises(BenchFault, match=r"3 frames.*0\.12 s"):
        bench.gel.read(3, 0.1)


def test_nothing_infinite_is_obeyed(bench: Bench) -> None:
    with pytest.raises(LimitExceeded):
        bench.arm.move_joints(np.array([np.nan] * 6), 1.0, 1.0)
    with pytest.raises(LimitExceeded):
        bench.arm.move_line(bench.start, -1.0, 1.0)
    with pytest.raises(BenchFault, match="ur5e"):
        bench.arm.move_line(bench.start @ translation(np.array([0.0, 0.0, 3.0])), 0.1, 0.1)


def test_the_truth_of_a_step_performed_again_replaces_the_old(
    tmp_path: Path, world: World, bench: Bench
) -> None:
    path = tmp_path / "truth.json"
    pose = bench.start @ translation(np.array([0.0, 0.0, STAND_OFF + 1e-3]))
    truth = TruthFile(path, world, 5)
    truth.append(pose, 0, 0)
    truth.append(pose, 1, 0)
    written = path.read_bytes()
    again = TruthFile(path, world, 5)  # as after a crash and a resume
    again.append(pose, 1, 0)
    assert path.read_bytes() == written
    TruthFile(path, world, 6).append(pose, 0, 0)  # of another run: nothing of this one is kept
    assert path.read_text().count("point_in_object_m") == 1
    assert not list(tmp_path.glob(".*"))
