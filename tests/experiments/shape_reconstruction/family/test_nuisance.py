"""Cost of the bench errors that a shape needs: zero on a calibrated bench, and the largest is named."""

import numpy as np
import pytest

from experiments.shape_reconstruction.family import layout
from experiments.shape_reconstruction.family.freedom import bench_rows, nuisance_cost
from experiments.shape_reconstruction.thresholds import MAX_NUISANCE_COST

SUPPORT = 1.0e-3
ROWS = bench_rows(place=0.02, support=SUPPORT, pixel=1.0e-3, shift=2.0e-3, scale=0.01)


def test_a_bench_as_it_is_expected_has_no_nuisance_cost() -> None:
    middle = np.random.default_rng(0).normal(size=layout.POSE_SIZE)
    other = np.append(middle, 1.0)  # the shape's own numbers are not the bench's
    other[layout.YAW] += 1.0  # any turn is as likely
    assert nuisance_cost(other, ROWS, middle).cost == 0.0


@pytest.mark.parametrize("row", range(len(ROWS)))
def test_each_number_costs_by_its_own_deviation_and_is_named(row: int) -> None:
    slot = int(np.argmax(np.abs(ROWS[row])))
    off = np.zeros(layout.POSE_SIZE)
    off[slot] = -7.0 / ROWS[row, slot]
    found = nuisance_cost(off, ROWS, np.zeros(layout.POSE_SIZE))
    assert found.cost == pytest.approx(0.5 * 7.0**2)
    assert found.is_excessive
    assert "off by" in found.largest
    assert found.largest.endswith("7 standard deviations")
    assert not nuisance_cost(0.5 * off, ROWS, np.zeros(layout.POSE_SIZE)).is_excessive


def test_a_shape_that_floats_is_reported_with_its_height() -> None:
    off = np.zeros(layout.POSE_SIZE)
    off[layout.LIFT], off[layout.TILT_X] = 11.0 * SUPPORT, np.radians(0.8)
    assert nuisance_cost(off, ROWS, np.zeros(layout.POSE_SIZE)).largest == (
        "its support's height off by 11.0 mm, 11 standard deviations"
    )


def test_many_small_errors_are_not_excessive() -> None:
    """A bench whose numbers are all off by one and a half of their deviations is still calibrated."""
    off = np.zeros(layout.POSE_SIZE)
    for row in ROWS:
        slot = int(np.argmax(np.abs(row)))
        off[slot] = 1.5 / row[slot]
    assert nuisance_cost(off, ROWS, np.zeros(layout.POSE_SIZE)).cost < MAX_NUISANCE_COST
