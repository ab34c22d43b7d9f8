"""A pose that is wrong: its contact is turned against the shape, and no other is."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.shape_reconstruction.evidence import GuardedTouch
from experiments.shape_reconstruction.family import layout
from experiments.shape_reconstruction.family.contact_fit import find_rotated_contacts
from experiments.shape_reconstruction.family.distance import distances
from experiments.shape_reconstruction.family.kind import FamilyShape
from experiments.shape_reconstruction.family.kinds import draw_shape
from harness.basics.arrays import FloatArray
from harness.basics.geometry import frame_facing, rotation_from_vector, transform
from tests.support.shape_readings import SIGMA, shape_readings

ANGLE = np.radians(15.0)


@pytest.fixture(scope="module")
def can() -> FamilyShape:
    return draw_shape("can", np.random.default_rng(3))


def pressed(shape: FamilyShape, bearing: float, height: float, index: int) -> GuardedTouch:
    """Level, at the side: a piece of surface as wide as the gel, by the shape's own distances."""
    out = np.array([np.cos(bearing), np.sin(bearing), 0.0])
    across = np.array([-out[1], out[0], 0.0])
    u, v = np.meshgrid(np.linspace(-4e-3, 4e-3, 5), np.linspace(-3e-3, 3e-3, 5))
    middle = shape.theta[[layout.X, layout.Y, layout.LIFT]] + np.array([0.0, 0.0, height])
    points = middle + 0.2 * out + u.reshape(-1, 1) * across + v.reshape(-1, 1) * np.array([0.0, 0.0, 1.0])
    for _ in range(40):
        points = points - distances(shape.code, shape.theta, points)[:, None] * out
    normals = np.repeat(out[None], len(points), axis=0)
    pose = transform(frame_facing(-out, 0.0), points.mean(axis=0))
    return GuardedTouch(pose, 30e-3, points, normals, SIGMA, 0.05, index)


def turned(touch: GuardedTouch, angle: float, bearing: float = 0.5) -> GuardedTouch:
    """A pose that is wrong by an angle, and all that was read by it."""
    pose = touch.stand_from_gel.copy()
    vector = angle * (np.cos(bearing) * pose[:3, 0] + np.sin(bearing) * pose[:3, 1])
    turn, origin = rotation_from_vector(vector), pose[:3, 3].copy()
    pose[:3, :3] = turn @ pose[:3, :3]
    points, normals = (touch.points - origin) @ turn.T + origin, touch.normals @ turn.T
    return replace(touch, stand_from_gel=pose, points=points, normals=normals)


def angles(shape: FamilyShape, touches: list[GuardedTouch]) -> FloatArray:
    return find_rotated_contacts(shape, shape_readings(tuple(touches), None))


def touches_of(shape: FamilyShape) -> list[GuardedTouch]:
    return [pressed(shape, 1.1 * k, 0.016 + 0.003 * k, k) for k in range(6)]


@pytest.mark.parametrize("bearing", [0.0, 1.0, 2.5, 4.0])
def test_a_contact_that_is_turned_is_found_with_its_angle_and_no_other(
    can: FamilyShape, bearing: float
) -> None:
    touches = touches_of(can)
    assert (angles(can, touches) == 0.0).all()
    touches[2] = turned(touches[2], ANGLE, bearing)
    found = angles(can, touches)
    assert np.flatnonzero(found).tolist() == [2]
    assert found[2] == pytest.approx(ANGLE, rel=0.25)


def test_errors_of_the_gel_and_a_shape_that_lies_beside_are_no_turn(can: FamilyShape) -> None:
    touches = [turned(touch, np.radians(4.0)) for touch in touches_of(can)]
    assert (angles(can, touches) == 0.0).all()
    deep = replace(touches[2], points=touches[2].points - 6e-3 * touches[2].normals)
    assert (angles(can, [*touches[:2], deep, *touches[3:]]) == 0.0).all()


def test_where_the_shape_is_turned_against_all_of_them_no_pose_is_named(can: FamilyShape) -> None:
    assert (angles(can, [turned(touch, ANGLE) for touch in touches_of(can)]) == 0.0).all()


def test_presses_on_edges_are_not_judged(can: FamilyShape) -> None:
    touches = touches_of(can)
    edge = turned(touches[2], ANGLE)
    bent = edge.normals + 0.5 * np.sign(edge.points - edge.points.mean(axis=0))
    bent /= np.linalg.norm(bent, axis=1)[:, None]
    narrow = edge.points.mean(axis=0) + 0.02 * (edge.points - edge.points.mean(axis=0))
    for replaced in (replace(edge, normals=bent), replace(edge, points=narrow)):
        assert (angles(can, [*touches[:2], replaced, *touches[3:]]) == 0.0).all()
    assert len(angles(can, [])) == 0
