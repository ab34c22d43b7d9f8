"""What a round draws from: no few draws carry the answer, however thin or wide the posterior is."""

from typing import cast

import numpy as np
import pytest

from experiments.contact_localization.model import Prior
from experiments.contact_localization.posterior.grid import drawn, of_pairs, refine
from experiments.contact_localization.posterior.hypotheses import Hypotheses, systematic
from experiments.contact_localization.posterior.search import Search
from harness.basics.arrays import FloatArray, IntArray

MEMBERS = np.array([0])
THIN = np.array([0.15e-3, 0.15e-3, 0.1e-3])
CARRIED = 0.6e-3
FLOOR = 0.15
AWAY = 80e-3
AHEAD = 4.0


class OneContact:
    """What a round asks of a run with one contact, its yaw known."""

    def __init__(self) -> None:
        self.prior = Prior(np.eye(3), "known")
        self.positions = np.zeros((1, 3))
        self.yaw_observable = True


class Slanted(OneContact):
    """A place known to 0.1 mm but for what shared errors carry it: thin in ten dimensions."""

    def weigh(
        self, at: Hypotheses, members: IntArray, step: int, rings: int, within: float = np.inf
    ) -> Hypotheses:
        gels, nats, sigmas = at.gels, -0.5 * (at.yaws / np.radians(0.5)) ** 2, np.hypot(THIN, CARRIED)
        if at.shared is not None:
            gels = gels - CARRIED * (at.shared[:, :3] + at.shared[:, 3:]) / np.sqrt(2.0)
            nats, sigmas = nats - 0.5 * np.sum(at.shared**2, axis=1), THIN
        told = at.told(nats - 0.5 * np.sum((gels / sigmas) ** 2, axis=1))
        return told.best(within, len(at.yaws))


class Floor(OneContact):
    """Every place of a flat square is alike, and what is off it by more than a little is none."""

    def weigh(
        self, at: Hypotheses, members: IntArray, step: int, rings: int, within: float = np.inf
    ) -> Hypotheses:
        beside = np.maximum(np.abs(at.gels[:, :2]) - FLOOR, 0.0)
        nats = -0.5 * np.sum((beside / 1e-3) ** 2, axis=1) - 0.5 * (at.gels[:, 2] / 0.3e-3) ** 2
        nats = nats - 0.5 * (at.yaws / np.radians(2.0)) ** 2
        if at.shared is not None:
            nats = nats - 0.5 * np.sum(at.shared**2, axis=1)
        return at.told(nats).best(within, len(at.yaws))


class TwoPlaces(OneContact):
    """Two thin places 80 mm apart, the yaw unknown: the nearer weighs ``AHEAD`` nats more."""

    def __init__(self) -> None:
        super().__init__()
        self.prior = Prior(np.eye(3), "unknown")

    def weigh(
        self, at: Hypotheses, members: IntArray, step: int, rings: int, within: float = np.inf
    ) -> Hypotheses:
        nats = -0.5 * (at.yaws / np.radians(0.5)) ** 2
        if at.shared is not None:
            nats = nats - 0.5 * np.sum(at.shared**2, axis=1)
        here, there = (-0.5 * np.sum(((at.gels - (x, 0.0, 0.0)) / 0.4e-3) ** 2, axis=1) for x in (0.0, AWAY))
        return at.told(nats + np.logaddexp(here + AHEAD, there)).best(within, len(at.yaws))


def samples_of_a_slab() -> Hypotheses:
    """As a grid gives them: places 2 mm apart around the answer, yaws by one degree."""
    steps = 2e-3 * np.arange(-1.5, 2.0)
    places = np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(-1, 3)
    yaws = np.radians(np.arange(-2.0, 3.0))
    gels = np.repeat(places, len(yaws), axis=0)
    all_yaws = np.tile(yaws, len(places))
    return Slanted().weigh(Hypotheses(gels, all_yaws, np.zeros(len(all_yaws))), MEMBERS, 2, 1)


@pytest.mark.parametrize("seed", range(8))
def test_no_draw_carries_a_thin_slanted_posterior_alone(seed: int) -> None:
    found = refine(cast(Search, Slanted()), samples_of_a_slab(), MEMBERS, 3000, 5, seed)
    assert found.effective > 60.0
    assert found.weights.max() < 0.1
    wide = np.hypot(THIN, CARRIED)
    error = 4.0 / np.sqrt(found.effective)
    assert (found.weights @ found.gels) / wide == pytest.approx(0.0, abs=error)
    assert np.sqrt(found.weights @ found.gels**2) / wide == pytest.approx(1.0, abs=error)


def test_a_bare_floor_is_answered_by_its_samples() -> None:
    """Few draws over so many places would lose nearly all of them; the samples hold them."""
    floor, rng = Floor(), np.random.default_rng(0)
    gels = np.column_stack([rng.uniform(-FLOOR, FLOOR, (3000, 2)), np.zeros(3000)])
    start = floor.weigh(Hypotheses(gels, np.zeros(3000), np.zeros(3000)), MEMBERS, 2, 1)
    assert refine(cast(Search, floor), start, MEMBERS, 3000, 5, 0) is start


@pytest.mark.parametrize("rounds", [1, 2, 3])
def test_rounds_do_not_lose_what_an_earlier_one_had(rounds: int) -> None:
    """One more round never leaves fewer effective draws."""
    few, more = (
        refine(cast(Search, Slanted()), samples_of_a_slab(), MEMBERS, 1500, n, 4)
        for n in (rounds, rounds + 1)
    )
    assert more.effective >= few.effective


def test_draws_are_weighed_by_one_over_their_own_density() -> None:
    """Drawn around one place, in closed form: the Gaussian of the first round, times the errors' prior."""
    one = Hypotheses(np.zeros((1, 3)), np.zeros(1), np.zeros(1))
    found = drawn(cast(Search, Slanted()), MEMBERS, one, 500, 0, np.random.default_rng(0))
    assert found.shared is not None
    units = np.column_stack(
        [found.gels / (0.8e-3, 0.8e-3, 0.6e-3), found.yaws / np.radians(0.8), found.shared]
    )
    expected = 0.5 * np.sum(units**2, axis=1)
    assert found.log_weights - found.log_weights[0] == pytest.approx(expected - expected[0], abs=1e-9)


@pytest.mark.parametrize("seed", range(6))
def test_what_a_grid_sees_only_from_aside_is_not_lost(seed: int) -> None:
    """All that it holds of the better place is 1.9 mm aside, seven nats below what it has of the other."""
    places = TwoPlaces()
    ring = 1.9e-3 * np.exp(1j * np.radians(60.0 * np.arange(6)))
    there = AWAY + 2e-5 * np.arange(-20, 21)
    gels = np.column_stack([np.append(ring.real, there), np.append(ring.imag, 0.0 * there), np.zeros(47)])
    start = places.weigh(Hypotheses(gels, np.zeros(47), np.zeros(47)), MEMBERS, 2, 1)
    behind = start.log_weights[:6].max()
    assert -8.0 < behind < -6.0
    found = refine(cast(Search, places), start, MEMBERS, 3000, 5, seed)
    near = float(found.weights[found.gels[:, 0] < 0.5 * AWAY].sum())
    assert near == pytest.approx(1.0 / (1.0 + np.exp(-AHEAD)), abs=0.03)


def test_how_parents_are_chosen_changes_no_sum() -> None:
    """A place is drawn from more often than it weighs, and weighs what it weighs."""
    places = TwoPlaces()
    gels = np.array([[0.0, 0.0, 0.0], [AWAY, 0.0, 0.0]])
    current = places.weigh(Hypotheses(gels, np.zeros(2), np.zeros(2)), MEMBERS, 2, 1)
    at = drawn(cast(Search, places), MEMBERS, current, 40_000, 0, np.random.default_rng(2))
    assert np.mean(at.gels[:, 0] > 0.5 * AWAY) > 3.0 * current.weights[1]
    found = places.weigh(at, MEMBERS, 2, 2)
    assert found.weights[found.gels[:, 0] > 0.5 * AWAY].sum() == pytest.approx(np.exp(-AHEAD), rel=0.25)


def test_sums_over_pairs_are_those_of_every_pair() -> None:
    rng = np.random.default_rng(7)
    points = np.vstack([rng.normal(size=(40, 5)), rng.normal(size=(30, 5)) + 200.0])
    near = np.linalg.norm(points[:, None] - points[None], axis=2) < 3.0
    gaps = (points[:, None] - points[None])[near]
    squares, pairs = of_pairs(points, near)
    assert pairs == len(gaps)
    assert squares == pytest.approx(gaps.T @ gaps, rel=1e-9, abs=1e-7)


def test_a_far_mode_does_not_widen_the_draws() -> None:
    """Two sure places 80 mm apart: every draw is within millimetres of one of them."""
    rng = np.random.default_rng(1)
    near = rng.normal(size=(400, 3)) * 0.3e-3
    gels = np.vstack([near, near + np.array([80e-3, 0.0, 0.0])])
    current = Hypotheses(gels, rng.normal(size=800) * 5e-3, np.zeros(800), rng.normal(size=(800, 6)))
    found = drawn(cast(Search, Slanted()), MEMBERS, current, 2000, 2, rng)
    off: FloatArray = np.minimum(np.abs(found.gels[:, 0]), np.abs(found.gels[:, 0] - 80e-3))
    assert off.max() < 3e-3


@pytest.mark.parametrize("count", [1, 7, 1000])
def test_each_is_drawn_as_often_as_its_weight_asks(count: int) -> None:
    weights = np.array([0.5, 0.3, 0.0, 0.2])
    times = np.bincount(systematic(weights, count, np.random.default_rng(3)), minlength=4)
    assert np.abs(times - count * weights).max() <= 1.0
    assert times[2] == 0
