"""Closed-form kinematics: what goes in comes out, on every branch, at every corner."""

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from harness.basics.arrays import FloatArray
from harness.basics.errors import WrongUse
from harness.basics.geometry import rotation_about, transform
from harness.bench import kinematics
from harness.bench.kinematics import ARM_TABLES, arm_table

PI = np.pi
models = st.sampled_from(sorted(ARM_TABLES))
postures = st.tuples(*[st.floats(-PI, PI)] * 6).map(np.array)
WORKING = np.radians([10.0, -80.0, 95.0, -105.0, -90.0, 20.0])


@given(models, postures)
def test_every_posture_found_for_a_pose_reaches_it(model: str, joints: FloatArray) -> None:
    pose = kinematics.forward(model, joints)
    found = kinematics.inverse(model, pose, wrist_3=float(joints[5]))
    assume(len(found) > 0 or abs(np.sin(joints[4])) > 1e-6)
    assert len(found) > 0
    # A stretched arm may be asked for 1e-9 of its length too much.
    assert np.abs(kinematics.forward(model, found) - pose).max() < 1e-9
    assert np.all((found > -PI) & (found <= PI))


@given(models, postures)
def test_the_posture_a_pose_was_made_with_is_among_those_found(model: str, joints: FloatArray) -> None:
    # Where two branches meet, the angles are as ill determined as the square root of rounding.
    frames = kinematics.link_frames(model, joints)
    # The wrist's centre, from the first axis.
    aside = float(np.hypot(*(frames[5, :2, 3])))
    assume(aside > arm_table(model).d[3] * 1.001)
    assume(abs(np.sin(joints[4])) > 1e-3)
    assume(abs(np.sin(joints[2])) > 1e-3)
    found = kinematics.inverse(model, frames[6])
    turned = np.abs((found - joints + PI) % (2 * PI) - PI)
    assert turned.max(axis=1).min() < 1e-9
    assert np.abs(kinematics.forward(model, found) - frames[6]).max() < 1e-12


@pytest.mark.parametrize("model", sorted(ARM_TABLES))
def test_a_working_posture_has_eight_different_branches(model: str) -> None:
    pose = kinematics.forward(model, WORKING)
    # Brought to less than half of the reach: from there every elbow and wrist can fold either way.
    pose[:3, 3] *= 0.45 * (arm_table(model).a[1] + arm_table(model).a[2]) / -np.linalg.norm(pose[:3, 3])
    found = kinematics.inverse(model, pose)
    assert found.shape == (8, 6)
    apart = np.abs(found[:, None] - found[None, :]).max(axis=-1) + 9.0 * np.eye(8)
    assert apart.min() > 0.1


@pytest.mark.parametrize("model", sorted(ARM_TABLES))
def test_at_zero_the_arm_lies_stretched_along_minus_x(model: str) -> None:
    table = arm_table(model)
    pose = kinematics.forward(model, np.zeros(6))
    expected = [table.a[1] + table.a[2], -(table.d[3] + table.d[5]), table.d[0] - table.d[4]]
    assert np.abs(pose[:3, 3] - expected).max() < 1e-15
    assert np.array_equal(pose[:3, 2], [0.0, -1.0, 0.0])


def test_stretched_out_straight_is_one_posture_and_a_hair_further_is_none() -> None:
    pose = kinematics.forward("ur5e", np.array([0.3, -1.0, 0.0, 0.4, 1.0, 0.2]))
    assert np.any(np.abs(kinematics.inverse("ur5e", pose)[:, 2]) < 1e-6)
    axis = kinematics.link_frames("ur5e", np.array([0.3, -1.0, 0.0, 0.4, 1.0, 0.2]))
    away = axis[3, :3, 3] - axis[1, :3, 3]
    further = pose.copy()
    further[:3, 3] += 1e-3 * away / np.linalg.norm(away)
    assert not np.any(np.abs(kinematics.inverse("ur5e", further)[:, 2]) < 1e-6)


def test_out_of_reach_is_no_posture() -> None:
    for position in ([2.0, 0.0, 0.3], [0.0, 0.0, 0.3]):
        pose = transform(np.eye(3), np.array(position))
        assert kinematics.inverse("ur5e", pose).shape == (0, 6)


def test_a_singular_wrist_keeps_the_last_joint_it_is_given() -> None:
    joints = np.array([0.3, -1.2, 1.4, -0.7, 0.0, 0.9])
    pose = kinematics.forward("ur5e", joints)
    nearest = kinematics.nearest_branch("ur5e", pose, joints, arm_table("ur5e").joint_range)
    assert nearest is not None
    assert np.abs(nearest - joints).max() < 1e-9
    assert float(kinematics.singularity("ur5e", joints)) < 1e-9


def test_the_nearest_branch_counts_whole_turns_within_the_range() -> None:
    joint_range = arm_table("ur5e").joint_range
    wound = WORKING + np.array([0.0, 0.0, 0.0, 0.0, 0.0, 2 * PI - 0.5])
    pose = kinematics.forward("ur5e", wound)
    nearest = kinematics.nearest_branch("ur5e", pose, wound, joint_range)
    assert nearest is not None
    assert np.abs(nearest - wound).max() < 1e-9
    low = np.array([[-PI] * 6, [PI] * 6])
    unwound = kinematics.nearest_branch("ur5e", pose, wound, low)
    assert unwound is not None
    assert np.all(np.abs(unwound) <= PI)
    assert kinematics.nearest_branch("ur5e", pose, wound, np.array([[0.0] * 6, [0.1] * 6])) is None


@given(models, postures)
def test_the_jacobian_is_the_slope_of_the_forward_kinematics(model: str, joints: FloatArray) -> None:
    slope, h = kinematics.jacobian(model, joints), 1e-6
    frame = kinematics.forward(model, joints)
    for joint in range(6):
        moved = kinematics.forward(model, joints + h * np.eye(6)[joint])
        back = kinematics.forward(model, joints - h * np.eye(6)[joint])
        assert np.abs((moved - back)[:3, 3] / (2 * h) - slope[:3, joint]).max() < 1e-8
        spin = (moved - back)[:3, :3] @ frame[:3, :3].T / (2 * h)
        assert np.abs(np.array([spin[2, 1], spin[0, 2], spin[1, 0]]) - slope[3:, joint]).max() < 1e-8


def test_a_batch_is_its_rows() -> None:
    joints = np.random.default_rng(0).uniform(-PI, PI, (4, 5, 6))
    poses = kinematics.forward("ur10e", joints)
    assert poses.shape == (4, 5, 4, 4)
    assert np.array_equal(poses[2, 3], kinematics.forward("ur10e", joints[2, 3]))
    assert kinematics.singularity("ur10e", joints).shape == (4, 5)


def test_turning_the_first_joint_turns_the_bench() -> None:
    turned = WORKING + np.array([0.7, 0, 0, 0, 0, 0])
    about_z = transform(rotation_about(np.array([0.0, 0.0, 1.0]), 0.7), np.zeros(3))
    assert np.allclose(
        kinematics.forward("ur3e", turned), about_z @ kinematics.forward("ur3e", WORKING), atol=1e-14
    )


@pytest.mark.parametrize("model", sorted(ARM_TABLES))
def test_published_inertias_are_those_of_bodies(model: str) -> None:
    table = arm_table(model)
    principal = np.linalg.eigvalsh(table.inertias)
    assert np.all(principal > 0)
    assert np.all(principal[:, 2] < principal[:, 0] + principal[:, 1])
    assert np.all(table.masses > 0)


def test_an_unknown_model_names_the_known_ones() -> None:
    with pytest.raises(WrongUse, match="ur10e, ur3e, ur5e"):
        kinematics.forward("ur5", np.zeros(6))


@pytest.mark.parametrize("model", sorted(ARM_TABLES))
def test_the_makers_description_of_the_chain_gives_the_same_flange(shared_data: Path, model: str) -> None:
    text = (shared_data / "robot" / "ur_nominal" / model / "default_kinematics.yaml").read_text()
    numbers = [float(n) for n in re.findall(r"^\s+(?:x|y|z|roll|pitch|yaw): (\S+)$", text, re.MULTILINE)]
    chain = np.array(numbers).reshape(6, 6)
    x, y, z = np.eye(3)
    for joints in np.random.default_rng(1).uniform(-PI, PI, (50, 6)):
        pose = np.eye(4)
        for offset, angle in zip(chain, joints, strict=True):
            turn = rotation_about(z, offset[5]) @ rotation_about(y, offset[4]) @ rotation_about(x, offset[3])
            pose = pose @ transform(turn @ rotation_about(z, angle), offset[:3])
        # Their file writes pi/2 with ten digits.
        assert np.abs(pose - kinematics.forward(model, joints)).max() < 2e-9
