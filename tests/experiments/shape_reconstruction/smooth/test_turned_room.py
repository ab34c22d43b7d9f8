"""Free space of a round body, turned about its axis: a vessel is hollow where the sensor was in it."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.shape_reconstruction.evidence import GuardedTouch, ShapeEvidence
from experiments.shape_reconstruction.smooth.free_space import ContactSamples, all_samples, sensor_depth
from experiments.shape_reconstruction.smooth.hermite import fit_rbf
from experiments.shape_reconstruction.smooth.revolution import SLACK, Revolution, rotated_space
from harness.basics.arrays import FloatArray
from harness.basics.faces.mesh_rays import is_inside
from tests.experiments.shape_reconstruction.touched import evidence_of, touch_of

RADIUS, HEIGHT, FLOOR = 0.05, 0.12, 0.006
UP = np.array([0.0, 0.0, 1.0])
CENTRE = np.array([0.01, -0.02, 0.0])


def patch(middle: FloatArray, normal: FloatArray, index: int) -> GuardedTouch:
    across = np.linalg.svd(normal[None])[2][1:]
    offsets = 3e-3 * np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]]) @ across
    points = CENTRE + middle + offsets
    return touch_of(points, normal, np.repeat(normal[None], len(points), axis=0), index)


def vessel() -> ShapeEvidence:
    """Touches of a pot's side and rim, and of its floor, half-way to its wall."""
    sides = [
        (np.array([RADIUS * np.cos(a), RADIUS * np.sin(a), z]), np.array([np.cos(a), np.sin(a), 0.0]))
        for z in (0.03, 0.07, 0.1)
        for a in np.arange(0.1, 6.0, 0.9)
    ]
    rim = [(np.array([RADIUS * np.cos(a), RADIUS * np.sin(a), HEIGHT]), UP) for a in (0.5, 2.5, 4.5)]
    floor = [(np.array([0.02, 0.0, FLOOR]), UP)]
    return evidence_of(tuple(patch(*each, k) for k, each in enumerate([*sides, *rim, *floor])))


def axis_of(samples: ContactSamples) -> Revolution:
    return Revolution(CENTRE[:2], np.ones(len(samples.points), dtype=bool))


def circle(radius: float, z: float) -> FloatArray:
    angles = np.linspace(0.0, 2.0 * np.pi, 9)
    places = np.column_stack([radius * np.cos(angles), radius * np.sin(angles), np.full(9, z)])
    return np.asarray(CENTRE + places)


def test_room_is_as_free_as_the_sensor_left_it_and_the_same_all_around() -> None:
    evidence = vessel()
    samples = all_samples(evidence)
    room = rotated_space(axis_of(samples), samples, evidence)
    assert room is not None
    places = circle(0.03, 0.06)
    assert np.ptp(room.at(places)) < 1e-9
    assert room.at(places).min() > SLACK
    assert (room.at(circle(0.03, 0.06)) >= sensor_depth(evidence, circle(0.03, 0.06)) - 2e-3).all()
    assert room.at(samples.points).max() <= SLACK
    assert (room.at(circle(0.02, 0.5 * FLOOR)) < 0.0).all()


def test_a_touch_whose_turned_room_would_hold_a_place_that_was_met_is_left_out() -> None:
    evidence = vessel()
    column = patch(np.array([-0.02, 0.0, 0.07]), UP, 99)  # stands on the floor, to one side
    samples = all_samples(replace(evidence, touches=(*evidence.touches, column)))
    assert rotated_space(axis_of(samples), samples, evidence) is None


def test_without_a_touch_down_into_it_a_round_body_has_no_room() -> None:
    evidence = vessel()
    part = replace(evidence, touches=evidence.touches[:-1])
    samples = all_samples(part)
    assert rotated_space(axis_of(samples), samples, part) is None


@pytest.mark.parametrize("last", ["met", "missed", "not made"])
def test_the_smooth_surface_of_a_vessel_is_open_where_a_touch_went_down_into_it(last: str) -> None:
    evidence, hollow = vessel(), last != "not made"
    *others, down = evidence.touches
    nothing = replace(down, points=np.zeros((0, 3)), normals=np.zeros((0, 3)))
    ends = {"met": [down], "missed": [nothing], "not made": []}[last]
    found = fit_rbf(replace(evidence, touches=(*others, *ends)))
    assert found.details()["axis_m"] == pytest.approx(CENTRE[:2], abs=1e-3)
    inside = is_inside(circle(0.03, 0.06)[:-1], found.mesh.corners)
    assert not inside.any() if hollow else inside.all()
    wall = is_inside(circle(RADIUS - 3e-3, 0.07)[:-1], found.mesh.corners)
    assert wall.all()
