"""Verdicts follow from residuals and a rate of false alarms, and from nothing else."""

import json

import numpy as np
import pytest
from scipy.stats import chi2

from harness.agreement.agreement import Residual, SenseResiduals, judge_residuals
from harness.basics.errors import OutOfDomain


def residual(step: int, chi_square: float, dof: float = 1.0) -> Residual:
    return Residual(step, "contact depth", chi_square, dof)


def test_right_models_are_refused_at_the_stated_rate() -> None:
    """Within three sigmas of the count, of 1000 runs of 12 residuals."""
    rng, runs, rate = np.random.default_rng(0), 1000, 0.05
    dofs = (1.0, 4.0, 27.5)
    refused = 0
    for _ in range(runs):
        drawn = [residual(k, float(rng.chisquare(dofs[k % 3])), dofs[k % 3]) for k in range(12)]
        refused += not judge_residuals("a mug", [SenseResiduals("arm", "twin", tuple(drawn))], rate).fits
    assert abs(refused - runs * rate) < 3.0 * np.sqrt(runs * rate)


def test_limits_are_shared_by_senses_and_by_the_residuals_of_each() -> None:
    one = SenseResiduals("arm", "twin", (residual(0, 0.0),))
    two = SenseResiduals("touch", "network", (residual(0, 0.0, 3.0), residual(1, 0.0, 3.0)))
    limits = [sense.limits for sense in judge_residuals("a mug", [one, two], 0.03).senses]
    assert limits[0] == pytest.approx([chi2.isf(0.015, 1.0)])
    assert limits[1] == pytest.approx([chi2.isf(0.0075, 3.0)] * 2)


def test_the_first_in_doubt_is_the_earliest_step() -> None:
    late = SenseResiduals("arm", "twin", (residual(0, 0.1), residual(3, 500.0)))
    early = SenseResiduals("touch", "network", (residual(1, 500.0), residual(2, 900.0)))
    found = judge_residuals("a mug", [late, early])
    assert found.first_doubt == (1, "touch")
    assert not found.fits


def test_what_cannot_be_compared_neither_fits_nor_accuses() -> None:
    silent = SenseResiduals("sound", "reference", (), "no contact was struck")
    found = judge_residuals("a mug", [silent])
    assert [one.verdict for one in found.senses] == ["not comparable"]
    assert not found.fits
    assert found.first_doubt is None
    assert "no contact was struck" in found.lines()[0]
    assert judge_residuals("a mug", [silent, SenseResiduals("arm", "twin", (residual(0, 0.1),))]).fits


def test_it_is_json_whatever_the_numbers() -> None:
    found = judge_residuals("a mug", [SenseResiduals("arm", "twin", (residual(0, 1e300),))])
    tree = json.loads(json.dumps(found.as_json(), allow_nan=False))
    assert tree["first_in_doubt"] == {"step": 1, "sense": "arm"}
    assert tree["senses"][0]["residuals"][0]["chi_square"] == 1e12


@pytest.mark.parametrize("value", [np.nan, np.inf, -1.0])
def test_a_residual_that_is_no_number_is_refused(value: float) -> None:
    with pytest.raises(OutOfDomain, match="step 3, contact depth"):
        residual(2, value)


@pytest.mark.parametrize("rate", [0.0, 1.0, -0.1, np.nan])
def test_a_rate_that_is_none_is_refused(rate: float) -> None:
    with pytest.raises(OutOfDomain, match="false alarm"):
        judge_residuals("a mug", [], rate)
