"""The next press goes where the shapes that the readings allow differ, and is likely to meet the object."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.shape_reconstruction.choosing import farthest, most_informative
from experiments.shape_reconstruction.disagreement import MOST, disagreement
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.family import layout
from experiments.shape_reconstruction.family.classes import FamilyShape, draw_shape
from experiments.shape_reconstruction.surface import ShapeEstimate
from harness.basics.arrays import FloatArray
from harness.basics.geometry import frame_facing, transform
from harness.objects.builtin import build
from tests.support.shape_readings import shape_readings, touches_on


def shape_at(height: float) -> FamilyShape:
    """A can, or one lifted by so much: as if its top were not known."""
    can = draw_shape("can", np.random.default_rng(3))
    theta = can.theta.copy()
    theta[[layout.X, layout.Y, layout.YAW, layout.TILT_X, layout.TILT_Y]] = 0.0
    theta[layout.LIFT] = height
    return FamilyShape("can", can.code, theta)


def estimate_of(*shapes: FamilyShape) -> ShapeEstimate:
    mesh = build("mug")
    stated = [
        {
            "class": one.name,
            "weight": 1.0 / len(shapes),
            "code": one.code.tolist(),
            "numbers": one.theta.tolist(),
        }
        for one in shapes
    ]
    nothing = np.zeros(len(mesh.vertices))
    known = np.zeros(len(mesh.vertices), np.int64)
    return ShapeEstimate(mesh, nothing, known, (), {}, (), 0.0, {"hypotheses": stated})


def evidence() -> ShapeEvidence:
    return shape_readings(touches_on(build("mug"), 1, 1), None)


def line(place: tuple[float, float, float], inward: tuple[float, float, float]) -> FloatArray:
    return transform(frame_facing(np.array(inward), 0.0), np.array(place))


LINES = np.array(
    [
        line((0.0, 0.0, 0.01), (0.0, 0.0, -1.0)),  # at the top, whose height is not known
        line((0.0, 0.0, 0.03), (-1.0, 0.0, 0.0)),  # at the side, which is
        line((0.5, 0.0, 0.01), (0.0, 0.0, -1.0)),  # beside it
    ]
)


@pytest.mark.parametrize("lifted", [4.0e-3, 8.0e-3])
def test_it_is_half_the_distance_between_two_surfaces_where_they_are_met(lifted: float) -> None:
    scores = disagreement(evidence(), estimate_of(shape_at(0.0), shape_at(2.0 * lifted)), LINES)
    assert scores is not None
    assert scores[0] == pytest.approx(min(lifted, MOST), abs=0.2e-3)
    assert scores[1] < 0.2 * scores[0]  # the can is a little narrower at its foot
    assert scores[2] == 0.0


def test_more_than_the_most_counts_as_that() -> None:
    scores = disagreement(evidence(), estimate_of(shape_at(0.0), shape_at(0.05)), LINES[:1])
    assert scores is not None
    assert scores[0] == pytest.approx(MOST)


def test_a_line_that_half_of_them_pass_by_counts_a_quarter() -> None:
    aside = shape_at(0.0)
    theta = aside.theta.copy()
    theta[layout.X] = 0.5
    apart = FamilyShape("can", aside.code, theta)
    pair = disagreement(evidence(), estimate_of(shape_at(0.0), shape_at(8.0e-3)), LINES[:1])
    four = disagreement(
        evidence(), estimate_of(shape_at(0.0), shape_at(8.0e-3), apart, replace(apart)), LINES
    )
    assert pair is not None
    assert four is None or four[0] == pytest.approx(0.25 * pair[0], rel=0.01)


def test_shapes_that_agree_leave_the_press_to_go_where_none_was() -> None:
    alike = estimate_of(shape_at(0.0), shape_at(1.0e-3))
    assert disagreement(evidence(), alike, LINES) is None
    assert np.array_equal(most_informative(evidence(), alike, LINES), farthest(evidence(), alike, LINES))


def test_an_estimate_without_hypotheses_says_nothing_of_where_it_is_unsure() -> None:
    assert disagreement(evidence(), estimate_of(), LINES) is None
