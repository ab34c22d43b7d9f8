"""Contacts at one place count once; contacts at different places each count in full."""

import numpy as np
import pytest

from harness.basics.arrays import FloatArray
from harness.basics.errors import OutOfDomain
from harness.bench.gap import USUAL
from harness.experiment.repeated_readings import PlaceTolerance, group_by_place, weigh_repeated

TOLERANCE = PlaceTolerance(lateral=2e-3, axial=4e-3, tilt=float(np.radians(5.0)))
UP = np.array([0.0, 0.0, 1.0])


def tilted(degrees: float) -> FloatArray:
    return np.array([np.sin(np.radians(degrees)), 0.0, np.cos(np.radians(degrees))])


def same_place(offset: FloatArray, axis: FloatArray) -> bool:
    """Group two contacts whose second differs by an offset in m and in its axis."""
    places = group_by_place(np.array([np.zeros(3), offset]), np.array([UP, axis]), TOLERANCE)
    return bool(places[0] == places[1])


def test_ten_copies_of_a_contact_are_one_place_with_a_total_weight_of_one() -> None:
    points = np.concatenate([np.tile([0.1, 0.2, 0.3], (10, 1)), [[0.2, 0.2, 0.3]]])
    places = group_by_place(points, np.tile(UP, (11, 1)), TOLERANCE)
    assert places.tolist() == [0] * 10 + [1]
    assert weigh_repeated(places) == pytest.approx([0.1] * 10 + [1.0])


@pytest.mark.parametrize(
    ("offset", "degrees", "same"),
    [
        ([1.9e-3, 0.0, 0.0], 0.0, True),
        ([2.1e-3, 0.0, 0.0], 0.0, False),
        ([0.0, 0.0, 3.9e-3], 0.0, True),  # a deeper press of the same place
        ([0.0, 0.0, -4.1e-3], 0.0, False),
        ([0.0, 0.0, 0.0], 4.9, True),
        ([0.0, 0.0, 0.0], 5.1, False),
        ([0.0, 0.0, 0.0], 180.0, False),  # the other face of a thin wall
    ],
)
def test_contacts_agree_within_each_tolerance(offset: list[float], degrees: float, same: bool) -> None:
    assert same_place(np.array(offset), tilted(degrees)) == same


def test_a_row_of_close_contacts_is_not_one_place() -> None:
    points = np.column_stack([np.arange(11) * 1e-3, np.zeros(11), np.zeros(11)])
    places = group_by_place(points, np.tile(UP, (11, 1)), TOLERANCE)
    assert len(np.unique(places)) == 4  # 10 mm in steps of 1 mm, each place 2 mm wide
    assert weigh_repeated(places).sum() == pytest.approx(4.0)


def test_a_bench_that_is_known_less_well_has_larger_places() -> None:
    usual, rough = (PlaceTolerance.from_errors(errors, 2.5e-3) for errors in (USUAL, USUAL.times(2.0)))
    assert usual.lateral == pytest.approx(3.0 * np.sqrt(2.0) * USUAL.arm)
    assert usual.axial == pytest.approx(usual.lateral + 2.5e-3)
    assert usual.tilt == pytest.approx(3.0 * np.sqrt(2.0) * np.hypot(USUAL.arm_tilt, USUAL.gel_tilt))
    assert rough.lateral == pytest.approx(2.0 * usual.lateral)
    assert rough.tilt == pytest.approx(2.0 * usual.tilt)


def test_no_contact_has_no_place() -> None:
    places = group_by_place(np.zeros((0, 3)), np.zeros((0, 3)), TOLERANCE)
    assert places.shape == (0,)
    assert weigh_repeated(places).shape == (0,)


@pytest.mark.parametrize(
    ("points", "axes"),
    [
        (np.zeros((2, 3)), np.zeros((1, 3))),
        (np.zeros((2, 2)), np.zeros((2, 2))),
        (np.full((1, 3), np.nan), np.zeros((1, 3))),
        (np.zeros((1, 3)), np.full((1, 3), np.inf)),
    ],
)
def test_contacts_that_are_not_finite_points_and_axes_are_refused(
    points: FloatArray, axes: FloatArray
) -> None:
    with pytest.raises(OutOfDomain, match=r"shape \(.*shape \("):
        group_by_place(points, axes, TOLERANCE)
