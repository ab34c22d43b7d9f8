"""Rotations compose, invert and survive the half turn where tools live."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.basics.arrays import FloatArray
from harness.basics.geometry import (
    apply,
    frame_facing,
    inverse,
    quaternion_from_rotation,
    rotation_about,
    rotation_from_quaternion,
    rotation_from_vector,
    transform,
    vector_from_rotation,
)

ROUNDOFF = 1e-14
"""A few units in the last place of numbers of order one."""

angles = st.floats(-np.pi, np.pi)
units = st.tuples(angles, angles, angles).map(np.array).filter(lambda v: np.linalg.norm(v) > 1e-3)


def unit(vector: FloatArray) -> FloatArray:
    normalised: FloatArray = vector / np.linalg.norm(vector)
    return normalised


@given(units, angles)
def test_a_rotation_survives_its_vector_and_its_quaternion(axis: FloatArray, angle: float) -> None:
    rotation = rotation_about(unit(axis), angle)
    assert np.abs(rotation_from_vector(vector_from_rotation(rotation)) - rotation).max() < 10 * ROUNDOFF
    assert (
        np.abs(rotation_from_quaternion(quaternion_from_rotation(rotation)) - rotation).max() < 10 * ROUNDOFF
    )


@pytest.mark.parametrize("short_of_pi", [0.0, 1e-16, 1e-12, 1e-9, 1e-6, 1e-3])
def test_no_digit_is_lost_near_a_half_turn(short_of_pi: float) -> None:
    axis = unit(np.array([0.3, -0.9, 0.2]))
    rotation = rotation_about(axis, np.pi - short_of_pi)
    again = rotation_from_vector(vector_from_rotation(rotation))
    assert np.abs(again - rotation).max() < 10 * ROUNDOFF


@given(units)
def test_a_frame_faces_its_axis(axis: FloatArray) -> None:
    frame = frame_facing(unit(axis), 0.7)
    assert np.abs(frame[:, 2] - unit(axis)).max() < 10 * ROUNDOFF
    # The construction divides by 1 + z, which costs digits towards its one pole.
    assert np.abs(frame @ frame.T - np.eye(3)).max() < 1e-9
    assert np.linalg.det(frame) == pytest.approx(1.0)


def test_a_frame_facing_straight_down_is_a_rotation() -> None:
    frame = frame_facing(np.array([0.0, 0.0, -1.0]), 0.0)
    assert np.linalg.det(frame) == pytest.approx(1.0)
    assert frame[2, 2] == -1.0


@given(units, angles, units)
def test_there_and_back(axis: FloatArray, angle: float, offset: FloatArray) -> None:
    b_from_a = transform(rotation_about(unit(axis), angle), offset)
    points = np.array([[0.1, 0.2, 0.3], [-1.0, 2.0, 5.0]])
    assert np.abs(apply(inverse(b_from_a), apply(b_from_a, points)) - points).max() < 100 * ROUNDOFF


def test_inverse_takes_a_batch() -> None:
    poses = np.array([transform(rotation_about(unit(np.ones(3)), a), np.ones(3) * a) for a in (0.1, 2.0)])
    assert np.abs(inverse(poses) @ poses - np.eye(4)).max() < 10 * ROUNDOFF
