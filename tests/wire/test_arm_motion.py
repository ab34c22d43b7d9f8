"""The arm driver, unchanged, moves a mocked controller through ur_rtde."""

import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from drivers.ur.arm import UrArm
from harness.basics.arrays import FloatArray
from harness.basics.errors import BenchFault, LimitExceeded, SafetyStop
from harness.basics.geometry import rotation_about, transform, translation, vector_from_rotation
from harness.bench import kinematics
from tests.support.arm_bench import DOWN, FLOOR, READY, FarEnd, make_arm


@pytest.fixture(scope="module")
def far_end() -> Iterator[FarEnd]:
    end = FarEnd()
    yield end
    end.close()


@pytest.fixture(scope="module")
def opened(far_end: FarEnd, tmp_path_factory: pytest.TempPathFactory) -> Iterator[UrArm]:
    arm = make_arm(far_end.address, tmp_path_factory.mktemp("lock"))
    arm.open()
    yield arm
    arm.close()


@pytest.fixture
def arm(opened: UrArm) -> UrArm:
    """At rest in the ready posture, out of contact, zeroed."""
    height = opened.state().base_from_flange[2, 3]
    if height < FLOOR + 0.03:
        opened.move_line(above(opened, FLOOR + 0.05 - height), 0.05, 0.5)
    opened.move_joints(READY, 0.5, 2.0)
    opened.zero_force()
    return opened


def above(arm: UrArm, height: float) -> FloatArray:
    return translation(np.array([0.0, 0.0, height])) @ arm.state().base_from_flange


def lower_to(arm: UrArm, height: float) -> None:
    """Straight down to ``height`` over the floor, slowly where it was touched before."""
    for stage, speed in ((max(height, 0.02), 0.4), (height, 0.05)):
        arm.move_line(above(arm, FLOOR + stage - arm.state().base_from_flange[2, 3]), speed, 1.5)


def test_the_controller_is_who_it_says(arm: UrArm) -> None:
    health = arm.health()
    assert health.identity.startswith("UR5")
    assert "PolyScope 5.12" in health.identity
    assert health.detail.startswith("safety normal")


def test_state_is_fresh_and_agrees_with_the_kinematics(arm: UrArm) -> None:
    state = arm.state()
    assert state.safety == "normal"
    assert not state.moving
    assert np.abs(kinematics.forward("ur5e", state.joints) - state.base_from_flange).max() < 1e-9


def test_a_joint_motion_reaches_its_target(arm: UrArm, far_end: FarEnd) -> None:
    target = READY + np.array([0.15, -0.1, 0.1, 0.05, -0.05, 0.3])
    arm.move_joints(target, 0.5, 2.0)
    assert np.abs(arm.state().joints - target).max() < 1e-6
    assert np.abs(far_end.joints() - target).max() < 1e-6
    assert not arm.state().moving


def test_a_line_reaches_its_target_and_is_straight(arm: UrArm) -> None:
    start = arm.state().base_from_flange
    turn = rotation_about(np.array([0.0, 0.0, 1.0]), 0.2)
    target = transform(start[:3, :3] @ turn, start[:3, 3] + [0.04, 0.06, -0.05])
    began = time.monotonic()
    arm.move_line(target, 0.1, 1.0)
    seconds = time.monotonic() - began
    reached = arm.state().base_from_flange
    assert np.linalg.norm(reached[:3, 3] - target[:3, 3]) < 1e-6
    assert np.linalg.norm(vector_from_rotation(reached[:3, :3].T @ target[:3, :3])) < 1e-6
    _, poses, _, _ = arm.history(seconds)
    along = (target[:3, 3] - start[:3, 3]) / np.linalg.norm(target[:3, 3] - start[:3, 3])
    offset = poses.values[:, :3] - start[:3, 3]
    assert np.abs(offset - np.outer(offset @ along, along)).max() < 1e-5


def test_a_stop_from_another_thread_ends_a_motion_within_150_ms(arm: UrArm) -> None:
    stopped: list[float] = []

    def stop_in_flight() -> None:
        while not arm.state().moving or np.abs(arm.state().joint_speeds).max() < 0.05:
            time.sleep(0.005)
        began = time.monotonic()
        arm.stop()
        stopped.append(time.monotonic() - began)

    target = READY + np.array([0.5, 0, 0, 0, 0, 0])
    stopper = threading.Thread(target=stop_in_flight)
    stopper.start()
    with pytest.raises(SafetyStop, match=r"joint motion.*request"):
        arm.move_joints(target, 0.3, 1.5)
    stopper.join()
    assert stopped[0] < 0.15
    here = arm.state().joints
    assert np.abs(here - target).max() > 0.1
    arm.move_joints(target, 0.3, 1.5)


def test_a_stop_at_rest_changes_nothing(arm: UrArm, far_end: FarEnd) -> None:
    joints, program, outputs = far_end.joints(), far_end.ask("programstate"), far_end.outputs()
    arm.stop()
    arm.stop()
    assert np.array_equal(far_end.joints(), joints)
    assert far_end.ask("programstate") == program == "PLAYING rtde_control"
    assert far_end.outputs() == outputs
    arm.move_joints(READY + 0.01, 0.2, 2.0)
    assert np.abs(far_end.joints() - READY - 0.01).max() < 1e-6


def test_contact_is_found_and_the_arm_rests_there(arm: UrArm) -> None:
    lower_to(arm, 0.01)
    arm.zero_force()
    assert arm.move_until_contact(DOWN, 0.01, 3.0, 0.03)
    state = arm.state()
    depth = FLOOR - state.base_from_flange[2, 3]
    assert 3.0 / 5000.0 - 2e-4 < depth < 3.0 / 5000.0 + 1e-3
    assert state.wrench[2] > 2.0
    assert np.abs(state.joint_speeds).max() < 1e-3
    assert arm.move_until_contact(DOWN, 0.01, 2.0, 0.03), "a search in contact ends there"


def test_a_search_that_meets_nothing_says_so(arm: UrArm) -> None:
    lower_to(arm, 0.05)
    before = arm.state().base_from_flange
    assert not arm.move_until_contact(DOWN, 0.03, 3.0, 0.02)
    after = arm.state().base_from_flange
    assert np.linalg.norm(after[:3, 3] - before[:3, 3] + [0, 0, 0.02]) < 1e-6


def test_zero_force_takes_the_sensors_bias_away(arm: UrArm) -> None:
    arm.zero_force()
    time.sleep(0.05)
    wrench = arm.history(0.05)[2].values
    assert np.linalg.norm(np.median(wrench[:, :3], axis=0)) < 0.2


def test_zero_force_is_refused_in_contact(arm: UrArm) -> None:
    lower_to(arm, 0.005)
    assert arm.move_until_contact(DOWN, 0.01, 3.0, 0.02)
    with pytest.raises(SafetyStop, match=r" mm .* mm"):
        arm.zero_force()


def test_pressing_beyond_the_limit_stops_the_arm_and_lets_it_retreat(arm: UrArm) -> None:
    lower_to(arm, 0.005)
    assert arm.move_until_contact(DOWN, 0.01, 3.0, 0.02)
    with pytest.raises(SafetyStop, match=r"\b10\.0 N"):
        arm.move_line(above(arm, -0.003), 0.01, 0.5)
    assert 9.0 < np.linalg.norm(arm.state().wrench[:3]) < 14.0
    arm.move_line(above(arm, 0.02), 0.05, 0.5)
    assert np.linalg.norm(arm.state().wrench[:3]) < 1.0


def test_a_digital_output_switches(arm: UrArm, far_end: FarEnd) -> None:
    """The tool's outputs are bits 16 and 17; switching one leaves the other, and all others, as they are."""
    expected = far_end.outputs()
    for index, on in ((0, True), (0, True), (1, True), (0, False), (0, False), (1, False)):
        bit = 1 << (16 + index)
        expected = expected | bit if on else expected & ~bit
        arm.set_digital_output(index, on)
        assert far_end.outputs() == expected


def test_limits_refuse_before_anything_moves(arm: UrArm, far_end: FarEnd) -> None:
    before = far_end.joints()
    with pytest.raises(LimitExceeded, match="workspace"):
        arm.move_line(above(arm, -0.5), 0.1, 1.0)
    with pytest.raises(LimitExceeded, match="m/s"):
        arm.move_joints(READY + 1.0 * np.eye(6)[0], 1.4, 2.0)
    with pytest.raises(LimitExceeded):
        arm.move_joints(READY * np.nan, 0.1, 1.0)
    assert np.array_equal(far_end.joints(), before)


def test_history_covers_the_motion_packet_by_packet(arm: UrArm) -> None:
    began = time.monotonic()
    arm.move_joints(READY + 0.05, 0.1, 1.0)
    joints, _, _, clock = arm.history(time.monotonic() - began + 0.05)
    assert np.all(np.diff(joints.times) >= 0)
    assert np.abs(np.diff(clock.values) - 0.002).max() < 1e-9
    assert np.abs(joints.values[0] - READY).max() < 1e-6
    assert np.abs(joints.values[-1] - READY - 0.05).max() < 1e-6


@pytest.mark.parametrize("rate", [125.0, 500.0])
def test_the_stream_runs_at_the_rate_asked_for(
    far_end: FarEnd, opened: UrArm, tmp_path: Path, rate: float
) -> None:
    opened.close()
    arm = make_arm(far_end.address, tmp_path, rate=rate)
    arm.open()
    time.sleep(1.0)
    clock = arm.history(0.8)[3].values
    health = arm.health()
    arm.close()
    opened.open()
    steps = np.diff(clock) * rate
    assert np.abs(steps - 1.0).max() < 1e-6
    assert len(clock) == pytest.approx(0.8 * rate, rel=0.15)
    assert health.drops == 0


def test_one_motion_at_a_time(arm: UrArm) -> None:
    mover = threading.Thread(target=arm.move_joints, args=(READY + 0.1, 0.15, 1.5))
    mover.start()
    while not arm.state().moving:
        time.sleep(0.005)
    with pytest.raises(BenchFault, match="motion"):
        arm.move_joints(READY, 0.5, 2.0)
    mover.join()
