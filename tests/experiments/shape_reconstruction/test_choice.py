"""Acceptance rules: which candidate answers, what it states, and why the other does not."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from experiments.shape_reconstruction.family.freedom import NuisanceCost
from experiments.shape_reconstruction.family.kinds import draw_shape
from experiments.shape_reconstruction.fits import FOLDS, FamilyFit, SmoothSurface, folds_of
from experiments.shape_reconstruction.reconstruct import choose
from experiments.shape_reconstruction.thresholds import (
    ASSUMED_DEVIATION,
    MAX_BEYOND_CONTACTS,
    MAX_NUISANCE_COST,
    MAX_OUTLINE_ERROR,
    MIN_BLIND_CONTACTS,
    MIN_CONTACTS,
    MIN_LOG_ODDS,
    PREDICTION_SCALE,
)
from tests.support.family_shapes import family_fit, mixture_of

DEVIATION = 1.0e-3
EXCESSIVE = NuisanceCost(1.1 * MAX_NUISANCE_COST, "")


def fit_of(contacts: int, error: float = 0.0, **changes: Any) -> FamilyFit:
    can = draw_shape("can", np.random.default_rng(0))
    return family_fit(
        mixture_of(can), left_out=np.full(contacts, error), open_axes=("x",), flags=("family",), **changes
    )


def smooth_of(contacts: int, error: float = 0.0) -> SmoothSurface:
    fit = fit_of(contacts)
    return SmoothSurface(
        fit.mesh, fit.deviation, fit.known_by, (), {}, (), 0.0, "smooth", left_out=np.full(contacts, error)
    )


PRIOR = replace(smooth_of(0), estimator="prior")


def test_without_a_contact_the_prior_answers_and_the_family_where_there_is_none() -> None:
    fit = fit_of(0)
    assert choose(fit, None, PRIOR) is PRIOR
    assert choose(fit, None, None).flags[0] == "family"


@pytest.mark.parametrize("contacts", [1, MIN_CONTACTS])
@pytest.mark.parametrize(
    ("fit", "smooth", "by"),
    [
        (1e-3, 2e-3, "family"),
        (8e-3, 8e-3, "family"),  # alike: most objects are of the family
        (30e-3, 2e-3, "smooth"),
    ],
)
def test_what_predicts_left_out_contacts_better_answers_from_the_first_contact_on(
    contacts: int, fit: float, smooth: float, by: str
) -> None:
    found = choose(fit_of(contacts, fit), smooth_of(contacts, smooth), PRIOR)
    assert found.estimator == by
    if by == "smooth":
        assert (
            "left out are 30.0 mm off the household shape and 2.0 mm off the smooth surface"
            in found.flags[-1]
        )


def test_the_smooth_surface_must_be_likelier_by_the_stated_odds() -> None:
    """One contact off by the scale alone costs log 2."""
    smooth = smooth_of(1, PREDICTION_SCALE)
    for by, name in ((0.99, "family"), (1.01, "smooth")):
        error = PREDICTION_SCALE * np.sqrt(np.exp(np.log(2.0) + by * MIN_LOG_ODDS) - 1.0)
        assert choose(fit_of(1, error), smooth, None).estimator == name


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"outline_error": 1.1 * MAX_OUTLINE_ERROR}, "misses or adds 6 % of the outline"),
        ({"outline_error": 0.9 * MAX_OUTLINE_ERROR}, None),
        ({"nuisance": EXCESSIVE}, "on a bench as this is calibrated"),
        ({"sighted": False, "beyond_contacts": 1.1 * MAX_BEYOND_CONTACTS}, "11 mm beyond 12 contacts"),
        ({"sighted": False, "beyond_contacts": 0.9 * MAX_BEYOND_CONTACTS}, None),
        ({"sighted": True, "beyond_contacts": 1.1 * MAX_BEYOND_CONTACTS}, None),  # the picture shows it
    ],
)
def test_a_family_that_contradicts_the_readings_is_rejected_with_the_reason(
    changes: dict[str, Any], reason: str | None
) -> None:
    fit = fit_of(MIN_BLIND_CONTACTS, **changes)
    found = choose(fit, smooth_of(MIN_BLIND_CONTACTS, 20e-3), PRIOR)
    assert found.estimator == ("family" if reason is None else "smooth")
    if reason is not None:
        assert reason in found.flags[-1]
        assert "the smooth surface through all contacts" in found.flags[-1]
        assert found.flags[0] == "family"  # what is known of its contacts stays
        np.testing.assert_allclose(found.deviation, [20e-3, DEVIATION])


def test_a_shape_beyond_few_contacts_without_a_picture_may_be_there() -> None:
    few = MIN_BLIND_CONTACTS - 1
    fit = fit_of(few, sighted=False, beyond_contacts=1.1 * MAX_BEYOND_CONTACTS)
    assert choose(fit, smooth_of(few, 20e-3), None).estimator == "family"


@pytest.mark.parametrize("contacts", [0, 1, MIN_CONTACTS - 1, MIN_CONTACTS])
def test_an_assumed_family_states_the_deviation_of_the_assumption_and_bounds_nothing(contacts: int) -> None:
    found = choose(fit_of(contacts), smooth_of(contacts) if contacts else None, None)
    assumed = contacts < MIN_CONTACTS
    at_least = np.hypot(DEVIATION, ASSUMED_DEVIATION) if assumed else DEVIATION
    np.testing.assert_allclose(found.deviation, [at_least, DEVIATION])
    assert found.not_bounded == (("x",) if assumed else ())
    assert ("assuming a household shape" in " ".join(found.flags)) is assumed


def test_a_tested_family_is_no_surer_than_its_predictions_where_nothing_was_touched() -> None:
    fit, smooth = fit_of(MIN_CONTACTS, 3e-3), smooth_of(MIN_CONTACTS, 9e-3)
    np.testing.assert_allclose(choose(fit, smooth, None).deviation, [3e-3, DEVIATION])


def test_a_rejected_family_without_a_smooth_surface_answers_as_an_assumption() -> None:
    found = choose(fit_of(MIN_CONTACTS, nuisance=EXCESSIVE), None, None)
    assert found.deviation[0] > ASSUMED_DEVIATION
    assert found.not_bounded == ("x",)
    assert "calibrated" in found.flags[-1]


def test_where_no_household_shape_is_at_the_stated_place_the_smooth_surface_answers() -> None:
    found = choose(None, smooth_of(2), None)
    assert "no household shape at the stated place" in found.flags[-1]


@pytest.mark.parametrize("contacts", [0, 1, FOLDS, 3 * FOLDS + 1])
def test_every_contact_is_left_out_once(contacts: int) -> None:
    folds = folds_of(contacts)
    assert sorted(k for fold in folds for k in fold) == list(range(contacts))
    assert len(folds) == min(contacts, FOLDS)
