"""What a reading spares of an expected error: nothing less than nothing, and all of it where it tells all."""

import numpy as np
import pytest

from harness.basics.arrays import FloatArray
from harness.skills.exploring.bayes_risk import bayes_risk, bayes_risk_after

MOST = 18.0


def places(count: int, seed: int) -> tuple[FloatArray, FloatArray]:
    """Weights of places on a plane, and how far they are apart."""
    random = np.random.default_rng(seed)
    at, weights = random.normal(size=(count, 2)), random.uniform(0.1, 1.0, count)
    return weights / weights.sum(), np.linalg.norm(at[:, None] - at, axis=2)


@pytest.mark.parametrize("seed", range(5))
def test_a_reading_never_adds_to_the_expected_error(seed: int) -> None:
    weights, apart = places(30, seed)
    read = np.random.default_rng(seed).normal(size=(30, 4))
    read[:7, 0] = np.inf
    assert bayes_risk_after(read, weights, apart, MOST) <= bayes_risk(weights, apart) + 1e-12


def test_a_reading_that_is_the_same_on_all_spares_nothing() -> None:
    weights, apart = places(30, 1)
    for alike in (np.ones((30, 3)), np.full((30, 3), np.inf)):
        left = bayes_risk_after(alike, weights, apart, MOST)
        assert left == pytest.approx(bayes_risk(weights, apart), rel=1e-12)


def test_a_reading_that_differs_on_all_leaves_next_to_nothing() -> None:
    weights, apart = places(30, 1)
    read = 100.0 * np.arange(30.0)[:, None]
    assert bayes_risk_after(read, weights, apart, MOST) < 1e-5 * bayes_risk(weights, apart)


def test_what_is_met_is_told_from_what_is_not() -> None:
    apart = np.array([[0.0, 1.0], [1.0, 0.0]])
    weights = np.array([0.5, 0.5])
    read = np.array([[0.0, 0.0], [np.inf, 0.0]])
    assert bayes_risk(weights, apart) == 0.5
    assert bayes_risk_after(read, weights, apart, MOST) < 1e-7


def test_by_two_places_it_is_the_chance_of_taking_one_for_the_other() -> None:
    # Readings so many deviations apart: each is believed by its density at what is read on the true one.
    apart, weights, gap = np.array([[0.0, 1.0], [1.0, 0.0]]), np.array([0.5, 0.5]), 1.5
    read = np.array([[0.0], [gap]])
    other = np.exp(-0.5 * gap**2)
    assert bayes_risk_after(read, weights, apart, MOST) == pytest.approx(other / (1.0 + other), rel=1e-12)


def test_the_order_of_the_places_does_not_matter() -> None:
    weights, apart = places(20, 3)
    read, order = np.random.default_rng(3).normal(size=(20, 2)), np.random.default_rng(4).permutation(20)
    moved = bayes_risk_after(read[order], weights[order], apart[np.ix_(order, order)], MOST)
    assert moved == pytest.approx(bayes_risk_after(read, weights, apart, MOST), rel=1e-12)
