"""A contact is worth what it tells: the end of a long bar says where along it one is, its side does not."""

import numpy as np
import pytest

from experiments.contact_localization.model import Prior
from experiments.contact_localization.next_contact import (
    HYPOTHESES,
    MOST,
    BelievedGels,
    believed_gels,
    errors_left,
    readings_at,
)
from experiments.contact_localization.posterior.hypotheses import Hypotheses
from harness.basics.arrays import FloatArray
from harness.basics.faces.ray_mesh import RayMesh
from harness.basics.geometry import frame_facing, rotation_about, transform
from harness.basics.mesh import Mesh
from harness.skills.exploring.bayes_risk import bayes_risk

LONG, HALF = 0.1, 0.02
"""M: half the length of a bar, and half its width and height."""

UP, UNTURNED = np.array([0.0, 0.0, 1.0]), np.eye(3)


def bar() -> RayMesh:
    corners = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)], dtype=np.float64)
    faces = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]]
    faces += [[2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
    return RayMesh(Mesh(corners * [LONG, HALF, HALF], np.array(faces)))


def along_the_bar(places: FloatArray, turn: FloatArray = UNTURNED) -> BelievedGels:
    """The first contact was on the top, anywhere among some places along the bar."""
    gels = np.column_stack([places, np.zeros(len(places)), np.full(len(places), HALF)])
    return BelievedGels(
        gels,
        np.broadcast_to(turn.T, (len(places), 3, 3)),
        np.full(len(places), 1.0 / len(places)),
        np.array([0.4, 0.1, 0.3]),
    )


def pressed(at: BelievedGels, by: FloatArray, axis: FloatArray, turn: FloatArray = UNTURNED) -> FloatArray:
    """``base_from_gel`` of a press so far from the first, along an axis; both in the frame of the bar."""
    return transform(turn @ frame_facing(axis, 0.0), at.first_in_base + turn @ by)


ANYWHERE = np.linspace(-0.025, 0.025, 11)


def test_the_end_of_a_bar_tells_where_along_it_the_first_contact_was_and_its_top_does_not() -> None:
    at = along_the_bar(ANYWHERE)
    gaps = np.abs(ANYWHERE[:, None] - ANYWHERE)
    known = bayes_risk(at.weights, gaps)
    top = pressed(at, np.array([0.02, 0.0, 0.0]), -UP)
    end = pressed(at, np.array([LONG, 0.0, -HALF]), np.array([-1.0, 0.0, 0.0]))
    by_top, by_end = errors_left(bar(), at, [top, end])
    assert by_top == pytest.approx(known, rel=1e-6)
    assert by_end < 0.05 * known


def test_what_goes_past_the_end_is_told_from_what_is_stopped() -> None:
    places = np.array([-0.05, 0.05])
    at = along_the_bar(places)
    read, points = readings_at(bar(), at, pressed(at, np.array([0.08, 0.0, 0.0]), -UP))
    assert np.isfinite(read[0]).all()
    assert np.isinf(read[1, 0])
    np.testing.assert_allclose(points[0], [0.03, 0.0, HALF], atol=1e-9)
    (left,) = errors_left(bar(), at, [pressed(at, np.array([0.08, 0.0, 0.0]), -UP)])
    assert left < 0.1 * np.exp(-MOST)


def test_it_does_not_matter_where_the_bench_stands_nor_how_it_is_turned() -> None:
    turn = rotation_about(UP, 0.7)
    here, there = along_the_bar(ANYWHERE), along_the_bar(ANYWHERE, turn)
    by, axis = np.array([0.07, 0.0, 0.0]), -UP
    (one,) = errors_left(bar(), here, [pressed(here, by, axis)])
    (other,) = errors_left(bar(), there, [pressed(there, by, axis, turn)])
    assert one == pytest.approx(other, rel=1e-6)


def test_few_hypotheses_stand_for_all_of_a_posterior() -> None:
    random = np.random.default_rng(2)
    gels, yaws = random.normal(size=(3000, 3)), random.normal(0.0, 0.02, 3000)
    logs = -0.5 * gels[:, 0] ** 2
    posterior = Hypotheses(gels, yaws, logs - logs.max())
    few = believed_gels(posterior, Prior(np.eye(3)), np.zeros(3))
    assert len(few.weights) <= HYPOTHESES
    assert few.weights.sum() == pytest.approx(1.0)
    mean, spread = posterior.weights @ gels, few.weights @ few.gels
    assert np.linalg.norm(mean - spread) < 0.4
    np.testing.assert_allclose(
        few.object_from_base @ np.swapaxes(few.object_from_base, 1, 2),
        np.eye(3)[None].repeat(len(few.gels), 0),
        atol=1e-12,
    )
