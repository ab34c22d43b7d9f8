"""Weighted places: thinning keeps every yaw and place in its share; what a contact says of itself."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from experiments.contact_localization.posterior.hypotheses import Hypotheses, best_of
from experiments.contact_localization.touch.touch import UNKNOWN_INDENTATION, Contact, TouchNoise, contact_of
from harness.basics.arrays import FloatArray
from harness.bench.sensor import GELSIGHT_R15
from harness.sim.gel.height_map import RasterMesh
from tests.samples.synthetic_press import BLOCK, Press, contact, stepped_block

TOP = Press((-0.02, 0.012, 0.0255), (0.0, 0.0, -1.0), yaw=0.4, depth=0.7e-3)


def on_a_grid(samples: int, yaws: int) -> Hypotheses:
    """Every yaw at every sample, as the grid lists them, all as good."""
    gels = np.repeat(np.random.default_rng(0).normal(size=(samples, 3)), yaws, axis=0)
    return Hypotheses(gels, np.tile(np.arange(float(yaws)), samples), np.zeros(samples * yaws))


@given(weights=st.lists(st.floats(-200.0, 0.0), min_size=1, max_size=50))
@settings(max_examples=50)
def test_weights_are_shares_in_the_ratio_of_their_exponentials(weights: list[float]) -> None:
    log_weights = np.array(weights) - max(weights)
    n = len(weights)
    found = Hypotheses(np.zeros((n, 3)), np.zeros(n), log_weights).weights
    assert found.sum() == pytest.approx(1.0)
    assert found / found.max() == pytest.approx(np.exp(log_weights))


@pytest.mark.parametrize("most", [100, 300, 1000])
@pytest.mark.parametrize("yaws", [10, 11, 180])
def test_thinning_keeps_every_yaw_in_its_share(yaws: int, most: int) -> None:
    """A stride that the number of yaws divides would keep one yaw of all of them."""
    for samples in (most, 2 * most, 11 * most // 10):
        kept = on_a_grid(samples, yaws).best(1.0, most)
        counts = np.bincount(kept.yaws.astype(np.int64), minlength=yaws)
        assert counts == pytest.approx(len(kept.yaws) / yaws, abs=3.0 + 0.5 * len(kept.yaws) / yaws)


@given(count=st.integers(1, 5000), most=st.integers(1, 3000))
@settings(max_examples=80, deadline=None)
def test_as_many_are_kept_as_may_be(count: int, most: int) -> None:
    kept = best_of(np.zeros(count), 1.0, most)
    assert len(kept) == min(count, most)
    assert len(np.unique(kept)) == len(kept)


def test_thinning_covers_the_list_evenly() -> None:
    kept = best_of(np.zeros(10_000), 1.0, 500)
    assert np.all(np.diff(kept) > 0)
    assert np.diff(kept, prepend=0, append=10_000).max() <= 3 * 20


def test_only_what_is_near_the_best_is_kept_and_all_of_it_where_it_is_few() -> None:
    log_weights = np.array([-5.0, 0.0, -29.9, -30.1, -np.inf, -3.0])
    np.testing.assert_array_equal(best_of(log_weights, 30.0, 100), [0, 1, 2, 5])
    kept = Hypotheses(np.arange(18.0).reshape(6, 3), np.arange(6.0), log_weights).best(10.0, 100)
    np.testing.assert_array_equal(kept.yaws, [0.0, 1.0, 5.0])
    np.testing.assert_array_equal(kept.gels[:, 0], [0.0, 3.0, 15.0])
    np.testing.assert_array_equal(kept.log_weights, [-5.0, 0.0, -3.0])


def test_adding_a_constant_to_all_weights_keeps_the_same() -> None:
    log_weights = np.random.default_rng(1).uniform(-50.0, 0.0, 3000)
    np.testing.assert_array_equal(best_of(log_weights + 777.0, 30.0, 200), best_of(log_weights, 30.0, 200))


@pytest.fixture(scope="module")
def pressed() -> Contact:
    return contact(RasterMesh(stepped_block()), TOP)


def test_a_contact_knows_where_its_tool_points(pressed: Contact) -> None:
    assert pressed.axis == pytest.approx([0.0, 0.0, -1.0], abs=1e-12)
    assert pressed.shows_contact


def test_the_indentation_is_the_depth_at_the_centre(pressed: Contact) -> None:
    """On a peg of 4 mm radius the gel's own blur takes a little off."""
    assert pressed.indentation == pytest.approx(TOP.depth, abs=0.05e-3)


def test_a_contact_without_image_or_touch_has_the_usual_indentation(pressed: Contact) -> None:
    bare = Contact(pressed.base_from_gel)
    assert not bare.shows_contact
    assert bare.indentation == UNKNOWN_INDENTATION
    nothing = contact_of(pressed.base_from_gel, np.zeros((120, 160)), GELSIGHT_R15.pitch, BLOCK, TouchNoise())
    assert not nothing.shows_contact
    assert nothing.indentation == UNKNOWN_INDENTATION


@pytest.mark.parametrize("shape", [(120, 160), (128, 168)])
def test_the_centre_is_the_images_own_whether_its_sides_are_even_or_odd(shape: tuple[int, int]) -> None:
    """15 x 20 compared pixels have a centre between two columns; 16 x 21 between two rows."""
    y, x = (np.arange(side) + 0.5 - 0.5 * side for side in shape)
    ridge: FloatArray = 1e-3 * np.exp(-(x[None, :] ** 2 + y[:, None] ** 2) / (2.0 * 40.0**2))
    found = contact_of(np.eye(4), ridge, GELSIGHT_R15.pitch, BLOCK, TouchNoise())
    assert found.indentation == pytest.approx(1e-3, rel=0.03)
    shifted = contact_of(np.eye(4), np.roll(ridge, 24, axis=1), GELSIGHT_R15.pitch, BLOCK, TouchNoise())
    assert shifted.indentation == pytest.approx(1e-3 * np.exp(-(24.0**2) / (2.0 * 40.0**2)), rel=0.04)
