"""Laws of the mocked controller's kinematics and poses."""

import math

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mocks.ur.arm import poses
from mocks.ur.arm.kinematics import arm_model, follow, forward, postures, within_limits
from mocks.ur.hooks import HOME

MODELS = ["ur3e", "ur5e", "ur10e"]
six = st.tuples(*[st.floats(-3.0, 3.0)] * 6)


def _apart(a: npt.ArrayLike, b: npt.ArrayLike) -> float:
    return float(np.abs(np.array(a) - np.array(b)).max())


def _by_matrices(model: str, joints: tuple[float, ...]) -> npt.NDArray[np.float64]:
    """The chain as the maker's table states it, link after link."""
    arm = arm_model(model)
    d, a = (arm.d1, 0, 0, arm.d4, arm.d5, arm.d6), (0, arm.a2, arm.a3, 0, 0, 0)
    twist = (math.pi / 2, 0, 0, math.pi / 2, -math.pi / 2, 0)
    chain = np.eye(4)
    for q, di, ai, alpha in zip(joints, d, a, twist, strict=True):
        c, s, ca, sa = math.cos(q), math.sin(q), math.cos(alpha), math.sin(alpha)
        chain = chain @ [
            [c, -s * ca, s * sa, ai * c],
            [s, c * ca, -c * sa, ai * s],
            [0, sa, ca, di],
            [0, 0, 0, 1],
        ]
    return chain


@given(six, st.sampled_from(MODELS))
def test_forward_is_the_product_of_the_links(joints: tuple[float, ...], model: str) -> None:
    assert _apart(forward(arm_model(model), joints), _by_matrices(model, joints)) < 1e-12


@given(six, st.sampled_from(MODELS))
def test_every_posture_reaches_and_the_nearest_comes_first(joints: tuple[float, ...], model: str) -> None:
    arm = arm_model(model)
    pose = forward(arm, joints)
    found = postures(arm, pose, joints)
    distances = [max(abs(a - b) for a, b in zip(posture, joints, strict=True)) for posture in found]
    assert distances == sorted(distances)
    for posture in found:
        assert within_limits(posture)
        assert _apart(forward(arm, posture), pose) < 1e-7


def test_no_posture_reaches_too_far_or_too_near_or_nowhere() -> None:
    arm = arm_model("ur5e")
    for pose in ((1.2, 0.0, 0.3, 0.0, 0.0, 0.0), (0.0, 0.0, 0.3, 0.0, 0.0, 0.0), (math.nan,) * 6):
        assert postures(arm, poses.matrix_from_pose(pose), HOME) == []
        assert follow(arm, poses.matrix_from_pose(pose), HOME) is None


def test_whole_turns_are_kept_near_the_present_joints() -> None:
    arm = arm_model("ur5e")
    wound = (0.3, -1.2, 1.4, -1.5, -1.6, 5.9)
    assert postures(arm, forward(arm, wound), wound)[0] == pytest.approx(wound, abs=1e-9)


@given(st.tuples(*[st.floats(-1.0, 1.0)] * 3), st.floats(0.0, math.pi))
def test_rotation_vectors_come_back(axis: tuple[float, float, float], angle: float) -> None:
    size = math.hypot(*axis)
    vector = tuple(angle * part / size for part in axis) if size > 1e-3 else (angle, 0.0, 0.0)
    matrix = poses.matrix_from_pose((0.0, 0.0, 0.0, *vector))
    again = poses.matrix_from_pose((0.0, 0.0, 0.0, *poses.rotation_vector(matrix)))
    assert _apart(matrix, again) < 1e-12


@pytest.mark.parametrize("short_of_pi", [0.0, 1e-12, 1e-9, 1e-6])
def test_rotation_vectors_keep_their_digits_near_half_a_turn(short_of_pi: float) -> None:
    angle = math.pi - short_of_pi
    vector = (angle * 0.6, angle * 0.8, 0.0)
    matrix = poses.matrix_from_pose((0.0, 0.0, 0.0, *vector))
    assert np.abs(np.abs(poses.rotation_vector(matrix)) - np.array(vector)).max() < 1e-12


@given(six)
def test_an_inverse_undoes(joints: tuple[float, ...]) -> None:
    pose = forward(arm_model("ur5e"), joints)
    assert _apart(poses.compose(poses.inverse(pose), pose), poses.IDENTITY) < 1e-12
