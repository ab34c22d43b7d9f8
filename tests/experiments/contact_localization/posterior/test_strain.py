"""Readings further off than a bench's stated errors allow widen the region by as much as they are off."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.posterior import policy
from experiments.contact_localization.posterior.estimate import (
    MOST,
    STRAINED,
    USUAL_FIT,
    Estimate,
    locate,
    strain_of,
)
from experiments.contact_localization.posterior.hypotheses import Hypotheses
from experiments.contact_localization.posterior.likelihood import Noise
from experiments.contact_localization.posterior.policy import Readings, estimate_contacts
from experiments.contact_localization.posterior.search import Search
from experiments.contact_localization.touch.touch import Contact
from harness.basics.errors import FitRefused
from harness.bench.gap import USUAL
from harness.effects.accuracy import Accuracy
from tests.support.localization import dials

QUICK = dials(spacing=3e-3, rounds=1, samples=600)
DRAWS = 20_000


def drawn(search: Search, times: float) -> Hypotheses:
    """A posterior that learnt nothing, of errors so many times as large as believed."""
    rng = np.random.default_rng(0)
    yaws = times * search.prior.yaw_sigma * rng.standard_normal(DRAWS)
    shared = times * rng.standard_normal((DRAWS, 6))
    return Hypotheses(np.zeros((DRAWS, 3)), yaws, np.zeros(DRAWS), shared)


@pytest.mark.parametrize("times", [1.0, 1.5, 2.0])
def test_strain_is_how_many_times_larger_the_residuals_are(search: Search, times: float) -> None:
    fits = np.full(6, -0.5 * USUAL_FIT * times**2)
    assert strain_of(search, drawn(search, times), fits) == pytest.approx(times, rel=0.02)


def test_a_slipped_contact_alone_is_no_strain(search: Search) -> None:
    fits = np.full(6, -0.5 * USUAL_FIT)
    slipped = np.array([*fits[:-1], -1e6])
    assert np.isfinite(strain_of(search, drawn(search, 1.0), slipped))
    assert strain_of(search, drawn(search, 1.0), slipped) < MOST


def test_errors_are_taken_as_stated_until_the_fit_contradicts_them_and_never_for_too_large(
    plain: Estimate,
) -> None:
    strains = np.linspace(0.0, 5.0, 101)
    times = np.array([replace(plain, strain=strain).times_stated for strain in strains])
    assert (times[strains <= STRAINED] == 1.0).all()
    assert (np.diff(times) >= 0.0).all()
    assert times.max() == MOST


@pytest.fixture(scope="module")
def plain(contacts: tuple[Contact, ...], block: Model, prior: Prior) -> Estimate:
    return locate(contacts, block, prior, QUICK, Noise())[-1]


@pytest.mark.parametrize(("strain", "times"), [(1.0, 1.0), (1.7, 1.7), (9.0, MOST)])
def test_a_strained_answer_is_made_again_under_errors_so_much_larger(
    plain: Estimate, block: Model, prior: Prior, monkeypatch: pytest.MonkeyPatch, strain: float, times: float
) -> None:
    asked: list[tuple[float, float]] = []

    def at(errors: Any, readings: Readings, *_: object) -> tuple[Estimate, ...]:
        asked.append((errors.tilt / USUAL.tilt, readings.prior.yaw_sigma / prior.yaw_sigma))
        return (replace(plain, strain=strain),)

    monkeypatch.setattr(policy, "_estimate_under", at)
    found = estimate_contacts(Readings((), (), block, prior, 0), QUICK)[-1]
    expected = [(1.0, 1.0)] if times == 1.0 else [(1.0, 1.0), (times, times)]
    assert np.allclose(asked, expected)
    assert any("[errors]" in doubt for doubt in found.doubts) == (times > 1.0)


def test_what_fits_no_place_at_other_levels_is_looked_at_again_at_the_default_ones(
    plain: Estimate, block: Model, prior: Prior, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A grid's own error, or a finer one's luck, is no reason to call a right object another."""
    usual = dials()

    def at(_errors: Any, _readings: Readings, accuracy: Accuracy, *_: object) -> tuple[Estimate, ...]:
        if accuracy.levels != usual.levels:
            raise FitRefused("no place on this object explains the contacts")
        return (plain,)

    monkeypatch.setattr(policy, "_estimate_under", at)
    readings = Readings((), (), block, prior, 0)
    again, once = estimate_contacts(readings, QUICK)[-1], estimate_contacts(readings, usual)[-1]
    assert np.array_equal(again.position_in_object, once.position_in_object)
    assert any("default levels" in doubt for doubt in again.doubts)
    assert not once.doubts
    assert again.seconds["judge"] > once.seconds.get("judge", 0.0)


def test_what_fits_no_place_at_the_default_levels_is_refused_at_all(
    block: Model, prior: Prior, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[Accuracy] = []

    def at(_errors: Any, _readings: Readings, accuracy: Accuracy, *_: object) -> tuple[Estimate, ...]:
        asked.append(accuracy)
        raise FitRefused("no place on this object explains the contacts")

    monkeypatch.setattr(policy, "_estimate_under", at)
    for accuracy in (QUICK, dials()):
        with pytest.raises(FitRefused):
            estimate_contacts(Readings((), (), block, prior, 0), accuracy)
    assert len(asked) == 3
