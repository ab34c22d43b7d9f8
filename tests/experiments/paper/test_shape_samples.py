"""Touched points of the paper's networks: their frame, and the presses that training samples are made of."""

import numpy as np
import pytest

from experiments.paper.shape_network import TAKEN, frame_of, take_points
from experiments.paper.shape_samples import TouchedShape
from experiments.shape_reconstruction.prior.samples import shape_of
from harness.basics.errors import OutOfDomain
from harness.basics.faces.nearest_surface import NearestSurface

POINTS = np.random.default_rng(0).normal((0.1, 0.0, 0.15), 0.04, (300, 3))
MOVED = np.array([0.3, -0.2, 0.0])


def test_the_frame_is_left_as_it_was_entered_and_moves_and_grows_with_the_points() -> None:
    frame = frame_of(POINTS)
    assert frame.outward(frame.inward(POINTS)) == pytest.approx(POINTS)
    moved, larger = POINTS + MOVED, 2.5 * POINTS
    assert frame_of(moved).inward(moved) == pytest.approx(frame.inward(POINTS))
    assert frame_of(larger).inward(larger) == pytest.approx(frame.inward(POINTS))


def test_every_point_is_taken_as_often_as_can_be() -> None:
    rows = take_points(POINTS)
    assert rows.shape == (TAKEN, 3)
    _, counts = np.unique(rows, axis=0, return_counts=True)
    assert len(counts) == len(POINTS)
    assert counts.max() - counts.min() <= 1
    assert len(np.unique(take_points(np.tile(POINTS, (9, 1)) + np.arange(2700)[:, None]), axis=0)) == TAKEN


def test_touches_of_no_place_are_refused_by_name() -> None:
    with pytest.raises(OutOfDomain, match=r"0\.00 mm.* 1 mm"):
        frame_of(np.zeros((5, 3)))
    with pytest.raises(OutOfDomain, match=r"^\D*touch\D*$"):
        frame_of(np.zeros((0, 3)))


@pytest.mark.parametrize("number", range(4))
def test_touched_places_lie_on_the_shape_but_for_errors_of_reading(number: int) -> None:
    shape = TouchedShape(shape_of(number, seed=8), number)
    points = shape.touched(12, np.random.default_rng(number))
    if len(points):
        assert float(NearestSurface(shape.mesh).distances(points).max()) < 4e-3
