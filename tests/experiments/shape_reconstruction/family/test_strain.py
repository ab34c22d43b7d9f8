"""What a shape asks of the bench: nothing where that is as it was calibrated; named by what is off most."""

import numpy as np
import pytest

from experiments.shape_reconstruction.family import layout
from experiments.shape_reconstruction.family.freedom import STRAINED, bench_rows, strain_of

SUPPORT = 1.0e-3
ROWS = bench_rows(place=0.02, support=SUPPORT, pixel=1.0e-3, shift=2.0e-3, scale=0.01)


def test_a_bench_as_it_is_expected_is_not_strained() -> None:
    middle = np.random.default_rng(0).normal(size=layout.SIZE)
    other = middle.copy()
    other[layout.POSE_END :] += 1.0  # the shape's own numbers are not the bench's
    other[layout.YAW] += 1.0  # any turn is as likely
    assert strain_of(other, ROWS, middle).cost == 0.0


@pytest.mark.parametrize("row", range(len(ROWS)))
def test_each_number_costs_by_its_own_deviation_and_is_named(row: int) -> None:
    slot = int(np.argmax(np.abs(ROWS[row])))
    off = np.zeros(layout.SIZE)
    off[slot] = -7.0 / ROWS[row, slot]
    found = strain_of(off, ROWS, np.zeros(layout.SIZE))
    assert found.cost == pytest.approx(0.5 * 7.0**2)
    assert found.beyond_belief
    assert "off by" in found.most
    assert found.most.endswith("7 standard deviations")
    assert not strain_of(0.5 * off, ROWS, np.zeros(layout.SIZE)).beyond_belief


def test_a_shape_that_floats_says_by_how_much() -> None:
    off = np.zeros(layout.SIZE)
    off[layout.LIFT], off[layout.TILT_X] = 11.0 * SUPPORT, np.radians(0.8)
    assert strain_of(off, ROWS, np.zeros(layout.SIZE)).most == (
        "its support's height off by 11.0 mm, 11 standard deviations"
    )


def test_many_small_errors_are_no_strain() -> None:
    """A bench whose numbers are all off by one and a half of their deviations is still calibrated."""
    off = np.zeros(layout.SIZE)
    for row in ROWS:
        slot = int(np.argmax(np.abs(row)))
        off[slot] = 1.5 / row[slot]
    assert strain_of(off, ROWS, np.zeros(layout.SIZE)).cost < STRAINED
