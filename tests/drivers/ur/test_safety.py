"""The limits refuse what they must, say why, and let the rest through."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.ur import paths, safety
from drivers.ur.safety import SafetyLimits
from harness.basics.arrays import FloatArray
from harness.basics.errors import LimitExceeded, WrongUse
from harness.basics.geometry import rotation_about, transform, translation
from harness.bench import kinematics

MODEL = "ur5e"
LIMITS = SafetyLimits(workspace_low=(-0.9, -0.6, 0.02), workspace_high=(-0.1, 0.6, 0.9))
FLANGE = np.zeros((1, 3))
GEL = np.array([[0.0, 0.0, 0.12]])
# A posture well inside the box: the tool points down, elbow up.
READY = np.array([0.0, -1.4, 1.7, -1.87, -1.57, 0.0])


def line(
    target: FloatArray, start: FloatArray = READY, points: FloatArray = FLANGE, speed: float = 0.1
) -> paths.Path:
    pose = kinematics.forward(MODEL, start)
    return paths.line_path(MODEL, points, start, pose, target @ pose, speed, 1.5)


@pytest.mark.parametrize("address", ["127.0.0.1", "127.0.0.2", "127.255.1.9", "::1"])
def test_loopback_addresses_are_accepted(address: str) -> None:
    safety.require_loopback(address)


@pytest.mark.parametrize(
    "address",
    ["192.168.56.101", "10.0.0.2", "0.0.0.0", "robot.lab", "::", "", "127.0.0.1.nip.io"],  # noqa: S104
)
def test_every_other_address_is_refused_saying_why(address: str) -> None:
    with pytest.raises(WrongUse, match="real arm"):
        safety.require_loopback(address)


@pytest.mark.parametrize(
    "changes",
    [
        {"speed": 0.0},
        {"force_any": math.nan},
        {"workspace_low": (0.0, -1.0, 0.0)},
        {"joint_low": (7.0,) * 6},
        {"speed_near": 0.3},
        {"force_press": 26.0},
        {"travel": -0.1},
    ],
)
def test_limits_that_make_no_sense_are_refused(changes: dict[str, Any]) -> None:
    with pytest.raises(WrongUse):
        replace(LIMITS, **changes)


@pytest.mark.parametrize(
    "values", [[0.0] * 5, [0.0] * 7, [[0.0] * 6], [math.nan, 0, 0, 0, 0, 0], [0, 0, math.inf, 0, 0, 0]]
)
def test_vectors_of_wrong_length_or_not_finite_are_refused(values: list[float]) -> None:
    with pytest.raises(LimitExceeded):
        safety.vector("joints", values, 6)


@pytest.mark.parametrize("direction", [[0.0, 0.0, 0.0], [0.0, 0.0, 2.0], [1.0, 1.0, 0.0]])
def test_a_direction_has_length_one(direction: list[float]) -> None:
    with pytest.raises(LimitExceeded, match="length"):
        safety.unit_vector("direction", direction)


@pytest.mark.parametrize(
    "matrix",
    [
        np.eye(3),
        np.diag([1.0, 1.0, -1.0, 1.0]),
        np.diag([1.1, 1.0, 1.0, 1.0]),
        np.full((4, 4), np.nan),
        np.eye(4) + np.eye(4)[[3, 3, 3, 0]] * 1e-3,
    ],
)
def test_a_pose_is_a_rigid_transform(matrix: FloatArray) -> None:
    with pytest.raises(LimitExceeded):
        safety.pose("line", matrix)


@given(st.floats(allow_nan=True, allow_infinity=True))
def test_within_accepts_exactly_the_half_open_interval(value: float) -> None:
    if 0 < value <= 0.25:
        assert safety.within("speed", value, 0.25, "m/s", "") == value
    elif not value <= 0.25 * (1 + 1e-8):
        with pytest.raises(LimitExceeded, match=r"0\.25 m/s"):
            safety.within("speed", value, 0.25, "m/s", "")
    elif value <= 0:
        with pytest.raises(LimitExceeded):
            safety.within("speed", value, 0.25, "m/s", "")


def test_a_line_inside_everything_passes() -> None:
    safety.check_path(LIMITS, line(translation(np.array([0.05, 0.05, -0.05]))), None, "line")


def test_the_tool_point_is_what_stays_in_the_box_not_the_flange() -> None:
    start_z = kinematics.forward(MODEL, READY)[2, 3]
    down = translation(np.array([0.0, 0.0, -(start_z - 0.1)]))
    safety.check_path(LIMITS, line(down, points=FLANGE), None, "line")
    with pytest.raises(LimitExceeded, match=r"tool point 1 .*z = -0\.0\d+ m.* 0\.02"):
        safety.check_path(LIMITS, line(down, points=GEL), None, "line")


def test_a_joint_motion_whose_ends_are_inside_is_refused_for_its_middle() -> None:
    half_turn = READY + np.array([2.6, 0, 0, 0, 0, 0])
    box = replace(LIMITS, workspace_low=(-0.9, -0.2, 0.02), workspace_high=(0.9, 0.9, 0.9))
    path = paths.joint_path(MODEL, FLANGE, READY, half_turn, 0.1, 2.0)
    assert path.tool_points[-1, 0, 1] > -0.2
    with pytest.raises(LimitExceeded, match="y = -0"):
        safety.check_path(box, path, None, "joint motion")


def test_an_arm_outside_the_box_may_come_in_but_go_no_further_out() -> None:
    x = kinematics.forward(MODEL, READY)[0, 3]
    box = replace(LIMITS, workspace_low=(x + 0.01, -0.6, 0.02))
    safety.check_path(box, line(translation(np.array([0.03, 0.0, 0.0]))), None, "line")
    with pytest.raises(LimitExceeded):
        safety.check_path(box, line(translation(np.array([-0.01, 0.0, 0.0]))), None, "line")
    with pytest.raises(LimitExceeded):
        safety.check_path(box, line(translation(np.array([0.005, 0.0, 0.0]))), None, "line")


def test_joint_range_names_the_joint() -> None:
    narrow = replace(LIMITS, joint_low=(-1.0, -2.0, -2.0, -2.0, -1.0, -1.0))
    with pytest.raises(LimitExceeded, match=r"joint 5 .*-1\.5"):
        safety.check_path(narrow, line(np.eye(4)), None, "line")


def test_joint_step_is_limited_even_where_all_else_would_do() -> None:
    wrist = READY + np.array([0, 0, 0, 0, 0, 3.2])
    path = paths.joint_path(MODEL, FLANGE, READY, wrist, 0.1, 2.0)
    with pytest.raises(LimitExceeded, match=r"joint 6 .*3\.2"):
        safety.check_path(LIMITS, path, None, "joint motion")


def test_speed_is_of_the_tool_point_and_the_message_says_what_would_do() -> None:
    away = READY + np.array([0.5, 0, 0, 0, 0, 0])
    reach = float(np.hypot(*kinematics.forward(MODEL, READY)[:2, 3]))
    speed = 2 * LIMITS.speed / reach
    path = paths.joint_path(MODEL, FLANGE, READY, away, speed, 2.0)
    assert path.greatest_tool_speed == pytest.approx(2 * LIMITS.speed, rel=1e-3)
    with pytest.raises(LimitExceeded, match="50 %"):
        safety.check_path(LIMITS, path, None, "joint motion")


@pytest.mark.parametrize(("share", "passes"), [(0.999, True), (1.02, False)])
def test_the_joints_and_the_tool_are_each_held_to_their_own_speed(share: float, passes: bool) -> None:
    wrist = READY + np.array([0, 0, 0, 0, 0, 2.5])  # about an axis through the flange: no tool point moves
    base = READY + np.array([0.5, 0, 0, 0, 0, 0])
    reach = float(np.hypot(*kinematics.forward(MODEL, READY)[:2, 3]))
    for target, speed, words in (
        (wrist, LIMITS.joint_speed, "rad/s"),
        (base, LIMITS.speed / reach, " m/s"),
    ):
        path = paths.joint_path(MODEL, FLANGE, READY, target, share * speed, 2.0)
        if passes:
            safety.check_path(LIMITS, path, None, "joint motion")
        else:
            with pytest.raises(LimitExceeded, match=words):
                safety.check_path(LIMITS, path, None, "joint motion")


def test_a_way_too_short_to_reach_the_speed_is_judged_by_the_speed_it_reaches() -> None:
    beside = READY + np.array([0.01, 0, 0, 0, 0, 0])
    path = paths.joint_path(MODEL, FLANGE, READY, beside, 1.5, 2.0)
    reach = float(np.hypot(*kinematics.forward(MODEL, READY)[:2, 3]))
    assert path.greatest_tool_speed == pytest.approx(reach * math.sqrt(0.01 * 2.0), rel=1e-3)


def test_near_the_last_contact_the_slow_limit_holds_for_arriving_and_leaving() -> None:
    here = kinematics.forward(MODEL, READY)[:3, 3]
    up = line(translation(np.array([0.0, 0.0, 0.05])), speed=0.2)
    safety.check_path(LIMITS, up, None, "line")
    for above in (0.009, 0.055):
        with pytest.raises(LimitExceeded, match=r"0\.0500 m/s"):
            safety.check_path(LIMITS, up, here + np.array([0.0, 0.0, above]), "line")
    safety.check_path(LIMITS, up, here - np.array([0.0, 0.0, 0.02]), "line")


def test_a_line_out_of_reach_or_through_another_branch_is_refused() -> None:
    with pytest.raises(LimitExceeded, match="ur5e"):
        line(translation(np.array([-0.9, 0.0, 0.0])))
    x, y = kinematics.forward(MODEL, READY)[:2, 3]
    with pytest.raises(LimitExceeded, match=r"reach|branch"):
        line(translation(np.array([-2 * x, -2 * y, 0.0])))


def test_a_line_close_to_a_singular_posture_is_refused_at_speed_and_passes_slowly() -> None:
    # joint 5 near zero: the wrist spins to keep the tool's attitude
    start = READY * [1, 1, 1, 1, 0, 1] - [0, 0, 0, 0, 0.05, 0]
    side = translation(np.array([0.0, 0.06, 0.0]))
    fast = line(side, start=start, speed=0.25)
    with pytest.raises(LimitExceeded, match="singular"):
        safety.check_path(LIMITS, fast, None, "line")
    safety.check_path(LIMITS, line(side, start=start, speed=0.005), None, "line")


@given(st.lists(st.floats(-0.04, 0.04), min_size=3, max_size=3), st.floats(-0.3, 0.3))
def test_a_sampled_line_starts_and_ends_where_it_should_and_its_joints_reach_its_poses(
    offset: list[float], angle: float
) -> None:
    start = kinematics.forward(MODEL, READY)
    end = transform(start[:3, :3] @ rotation_about(np.array([0.0, 0.0, 1.0]), angle), start[:3, 3] + offset)
    path = paths.line_path(MODEL, GEL, READY, start, end, 0.1, 1.5)
    reached = kinematics.forward(MODEL, path.joints)
    assert np.abs(reached[-1] - end).max() < 1e-9
    assert np.abs(path.flange_positions - reached[:, :3, 3]).max() < 1e-9
    gel = reached[:, :3, 3] + 0.12 * reached[:, :3, 2]
    assert np.abs(path.tool_points[:, 0] - gel).max() < 1e-9


@given(st.floats(1e-4, 2.0), st.floats(1e-2, 2.0), st.floats(0.1, 5.0))
def test_trapezoid_covers_the_distance(distance: float, speed: float, acceleration: float) -> None:
    seconds = safety.trapezoid_seconds(distance, speed, acceleration)
    ramp = min(seconds / 2, speed / acceleration)
    covered = acceleration * ramp**2 + min(speed, acceleration * ramp) * (seconds - 2 * ramp)
    assert covered == pytest.approx(distance, rel=1e-9)
