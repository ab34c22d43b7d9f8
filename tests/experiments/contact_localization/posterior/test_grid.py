"""Refinement by importance sampling: the posterior asked for, whatever the seed, at the usual rate."""

from typing import Literal, cast

import numpy as np
import pytest

from experiments.contact_localization.model import Prior
from experiments.contact_localization.posterior.grid import refine
from experiments.contact_localization.posterior.hypotheses import Hypotheses
from experiments.contact_localization.posterior.search import Search
from harness.basics.arrays import FloatArray, IntArray

MEMBERS = np.array([0])
SIGMAS = np.array([0.5e-3, 0.4e-3, 0.3e-3, np.radians(0.7)])
CENTRE = np.array([0.3e-3, -0.6e-3, 0.2e-3, np.radians(0.4)])
APART = np.array([30e-3, 0.0, 0.0, 0.0])
READ = np.array([0.8, -0.5, 0.2])


class Known:
    """A run whose posterior is a sum of Gaussians in place and yaw.

    ``carries`` metres of place go with each sigma of a shared error, which is read to ``told`` sigmas.
    """

    def __init__(
        self,
        shares: tuple[float, ...] = (1.0,),
        yaw: Literal["known", "unknown"] = "known",
        carries: float = 0.0,
        told: float = np.inf,
    ) -> None:
        self.prior = Prior(np.eye(3), yaw)
        self.shares = shares
        self.positions = np.zeros((1, 3))
        self.yaw_observable = True
        self.carries, self.told = carries, told

    def weigh(
        self, at: Hypotheses, members: IntArray, step: int, rings: int, within: float = np.inf
    ) -> Hypotheses:
        gels, known = at.gels, 0.0
        if at.shared is not None:
            gels = gels - self.carries * at.shared[:, :3]
            known = -0.5 * np.sum(at.shared**2, axis=1)
            known = known - 0.5 * np.sum(((at.shared[:, :3] - READ) / self.told) ** 2, axis=1)
        places = np.column_stack([gels, at.yaws])
        parts = [
            np.log(share) - 0.5 * np.sum(((places - CENTRE - k * APART) / SIGMAS) ** 2, axis=1)
            for k, share in enumerate(self.shares)
        ]
        told = at.told(np.asarray(np.logaddexp.reduce(parts)) + known)
        return told.best(within, len(at.yaws))


def start_of(known: Known, seed: int = 0) -> Hypotheses:
    """As a grid gives them: places 2 mm apart in no order, yaws by one degree, weighed."""
    rng = np.random.default_rng(seed)
    bumps = range(len(known.shares))
    places = np.vstack([rng.uniform(-4e-3, 4e-3, (300, 3)) + k * APART[:3] for k in bumps])
    gels = np.repeat(places, 7, axis=0)
    yaws = np.tile(np.radians(np.arange(-3.0, 4.0)), len(places))
    return known.weigh(Hypotheses(gels, yaws, np.zeros(len(yaws))), MEMBERS, 2, 1)


def refined(known: Known, samples: int = 1200, rounds: int = 3, seed: int = 0) -> Hypotheses:
    return refine(cast(Search, known), start_of(known), MEMBERS, samples, rounds, seed)


def moments(found: Hypotheses) -> tuple[FloatArray, FloatArray]:
    at = np.column_stack([found.gels, found.yaws])
    mean = found.weights @ at
    return mean, np.sqrt(found.weights @ (at - mean) ** 2)


def effective(found: Hypotheses) -> float:
    return float(1.0 / np.sum(found.weights**2))


@pytest.mark.parametrize("yaw", ["known", "unknown"])
@pytest.mark.parametrize("seed", range(3))
def test_the_refined_posterior_is_the_one_asked_for(seed: int, yaw: Literal["known", "unknown"]) -> None:
    found = refined(Known(yaw=yaw), seed=seed)
    mean, sigma = moments(found)
    # Three standard errors of so many effective draws.
    error = 3.0 / np.sqrt(effective(found))
    assert np.abs(mean - CENTRE) / SIGMAS == pytest.approx(0.0, abs=error)
    assert sigma / SIGMAS == pytest.approx(1.0, abs=error)


def test_the_error_falls_with_the_square_root_of_the_draws() -> None:
    """One round, so that every draw counts: sixteen times the draws, a quarter of the error."""
    errors = []
    for samples in (150, 2400):
        known = Known()
        means = [moments(refined(known, samples, rounds=1, seed=seed))[0] for seed in range(24)]
        errors.append(np.sqrt(np.mean(((np.array(means) - CENTRE) / SIGMAS) ** 2)))
    # 96 numbers give a root mean square to 7 %; the shortest run draws at least 150.
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.35)


def test_the_weights_fill_the_posterior() -> None:
    """Drawn from nearly the posterior, the twentieth of the draws counts at which rounds end."""
    found = refined(Known(), samples=2000)
    assert effective(found) > 0.05 * 2000


@pytest.mark.parametrize("seed", range(3))
def test_the_best_hypothesis_is_the_one_of_the_greatest_density(seed: int) -> None:
    """A draw from the tail of what it was drawn from weighs more than many that fit better."""
    known, found = Known(), refined(Known(), seed=seed)
    bare = Hypotheses(found.gels, found.yaws, np.zeros(len(found.yaws)), found.shared)
    density = known.weigh(bare, MEMBERS, 2, 1).log_weights
    best = int(np.argmax(density))
    assert best != int(np.argmax(found.log_weights))
    np.testing.assert_array_equal(found.top.gels[0], found.gels[best])


@pytest.mark.parametrize("heavy", [0.5, 0.7, 0.9])
def test_two_bumps_keep_their_shares(heavy: float) -> None:
    """Neither is favoured for having more draws near it, nor lost."""
    shares = []
    for seed in range(6):
        found = refined(Known((heavy, 1.0 - heavy)), seed=seed)
        shares.append(float(found.weights[found.gels[:, 0] < 15e-3].sum()))
    assert np.mean(shares) == pytest.approx(heavy, abs=0.05)
    assert min(shares) > 0.25
    assert max(shares) < 0.99


def test_draws_that_crowd_one_bump_do_not_make_it_heavier() -> None:
    """The start says one bump ten times as often as the other: its weights still sum to a half."""
    known = Known((0.5, 0.5))
    start = start_of(known)
    left = start.gels[:, 0] < 15e-3
    many = np.r_[np.nonzero(~left)[0], np.repeat(np.nonzero(left)[0], 10)]
    crowded = Hypotheses(
        start.gels[many], start.yaws[many], start.log_weights[many] - np.log(np.where(left[many], 10.0, 1.0))
    )
    shares = []
    for seed in range(6):
        found = refine(cast(Search, known), crowded, MEMBERS, 1200, 2, seed)
        shares.append(float(found.weights[found.gels[:, 0] < 15e-3].sum()))
    assert np.mean(shares) == pytest.approx(0.5, abs=0.05)


@pytest.mark.parametrize("seed", range(3))
def test_shared_errors_are_told_as_well_as_prior_and_readings_tell_them(seed: int) -> None:
    """In closed form: a normal prior and a normal reading, and a place that is carried along."""
    found = refined(Known(carries=0.4e-3, told=0.7), samples=3000, seed=seed)
    assert found.shared is not None
    variance = 1.0 / (1.0 + 0.7**-2)
    shared = np.zeros(6)
    shared[:3] = READ * variance * 0.7**-2
    sigma = np.sqrt(np.r_[np.full(3, variance), np.ones(3)])
    error = 4.0 / np.sqrt(effective(found))
    mean = found.weights @ found.shared
    assert (mean - shared) / sigma == pytest.approx(0.0, abs=error)
    spread = np.sqrt(found.weights @ (found.shared - mean) ** 2)
    assert spread / sigma == pytest.approx(1.0, abs=error)
    wide = np.hypot(SIGMAS[:3], 0.4e-3 * np.sqrt(variance))
    place, over = moments(found)
    assert (place[:3] - CENTRE[:3] - 0.4e-3 * shared[:3]) / wide == pytest.approx(0.0, abs=error)
    assert over[:3] / wide == pytest.approx(1.0, abs=error)


def test_no_rounds_leave_the_grid_as_it_is() -> None:
    known = Known()
    start = start_of(known)
    found = refine(cast(Search, known), start, MEMBERS, 600, 0, 0)
    np.testing.assert_array_equal(found.gels, start.gels)
    np.testing.assert_array_equal(found.log_weights, start.log_weights)


def test_a_seed_gives_the_same_draws_and_another_other_ones() -> None:
    one, same, other = (refined(Known(), 300, seed=seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one.gels, same.gels)
    np.testing.assert_array_equal(one.log_weights, same.log_weights)
    assert len(one.gels) != len(other.gels) or not np.array_equal(one.gels, other.gels)


def test_the_greatest_log_weight_is_zero_so_that_none_overflows_or_vanishes() -> None:
    found = refined(Known(), 300)
    assert found.log_weights.max() == 0.0
    assert np.isfinite(found.weights).all()


def test_one_sure_hypothesis_is_a_start_as_well() -> None:
    """Where the grid leaves one place, the draws spread around it and find the posterior."""
    known = Known()
    start = Hypotheses(CENTRE[None, :3] + 0.5e-3, CENTRE[3:4], np.zeros(1))
    found = refine(cast(Search, known), start, MEMBERS, 1200, 3, 0)
    mean, sigma = moments(found)
    assert np.abs(mean - CENTRE) / SIGMAS == pytest.approx(0.0, abs=0.3)
    assert sigma / SIGMAS == pytest.approx(1.0, abs=0.3)


def test_a_wide_posterior_gets_more_draws() -> None:
    sure, wide = Known(), Known((0.25, 0.25, 0.25, 0.25))
    sure_draws, wide_draws = (len(refined(known, 60, rounds=1).gels) for known in (sure, wide))
    # What falls behind on the way is not handed back.
    assert 30 < sure_draws < 1.5 * sure_draws < wide_draws <= 5 * 60


def test_a_yaw_that_nothing_shows_is_left_alone() -> None:
    """Of a bowl every yaw is alike: the grid has one, and places are refined under it."""
    known = Known(yaw="unknown")
    known.yaw_observable = False
    start = start_of(known)
    alike = start.yaws == start.yaws[3]
    one = Hypotheses(
        start.gels[alike], start.yaws[alike], start.log_weights[alike] - start.log_weights[alike].max()
    )
    found = refine(cast(Search, known), one, MEMBERS, 1200, 3, 0)
    assert np.all(found.yaws == start.yaws[3])
    mean, sigma = moments(found)
    error = 3.0 / np.sqrt(effective(found))
    assert np.abs(mean - CENTRE)[:3] / SIGMAS[:3] == pytest.approx(0.0, abs=error)
    assert sigma[:3] / SIGMAS[:3] == pytest.approx(1.0, abs=error)
