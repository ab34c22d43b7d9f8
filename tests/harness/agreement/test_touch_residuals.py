"""A contact's chi-square where its model is off by an unknown amount, or wrong altogether at some places."""

import numpy as np
import pytest
from scipy.stats import chi2, kstest

from harness.agreement.agreement import Residual
from harness.agreement.touch import combine_chi_squares, count_residual

DOF = 6.0


def contacts(rng: np.random.Generator, count: int, gross: float, unlike: int = 0) -> list[Residual]:
    """Of a right object whose model is wrong at a share of places; the first ``unlike`` do not fit at all."""
    drawn = np.where(rng.random(count) < gross, 1e3, rng.chisquare(DOF, count))
    drawn[:unlike] = 1e3
    return [
        Residual(k, "gel surface", combine_chi_squares(np.array([one]), DOF, gross), DOF)
        for k, one in enumerate(drawn)
    ]


def probability_of(residual: Residual) -> float:
    return float(chi2.sf(residual.chi_square, residual.dof))


def test_one_noise_leaves_a_chi_square_as_it_is() -> None:
    assert combine_chi_squares(np.array([17.0]), DOF) == 17.0


def test_noises_that_are_drawn_give_a_chi_square() -> None:
    """Where each run's noise is one of those stated, and nobody knows which."""
    rng = np.random.default_rng(0)
    variances = np.array([1.0, 2.0, 10.0])
    gaps = rng.normal(size=(2000, 6)) * np.sqrt(rng.choice(variances, size=(2000, 1)))
    squares = (gaps**2).sum(axis=1)[:, None] / variances
    found = np.array([combine_chi_squares(each, DOF) for each in squares])
    # A mean over noises need not be uniform; no level may be undercut more often than it says.
    for level in (0.5, 0.1, 0.01):
        assert np.mean(chi2.sf(found, DOF) < level) < level + 3.0 * np.sqrt(level / len(found))


def test_a_gross_error_is_never_less_probable_than_stated() -> None:
    assert chi2.sf(combine_chi_squares(np.array([1e9]), DOF, 0.05), DOF) == pytest.approx(0.05)
    assert np.isfinite(combine_chi_squares(np.array([1e9, 1e12]), DOF))


def test_contacts_that_fit_but_for_a_share_are_no_doubt() -> None:
    rng = np.random.default_rng(1)
    found = [probability_of(count_residual(contacts(rng, 6, 0.05), 0.05)) for _ in range(400)]
    assert np.mean(np.array(found) < 0.01) < 0.01 + 3.0 * np.sqrt(0.01 / len(found))


@pytest.mark.parametrize(("unlike", "doubted"), [(0, False), (1, False), (2, False), (4, True), (6, True)])
def test_many_contacts_that_do_not_fit_speak_against_an_object(unlike: int, doubted: bool) -> None:
    found = count_residual(contacts(np.random.default_rng(2), 6, 0.0, unlike), 0.05)
    assert found.step == 5
    assert (probability_of(found) < 1e-3) == doubted
    assert found.numbers["unlike"] == unlike


def test_counts_are_exact_where_nothing_is_gross() -> None:
    rng = np.random.default_rng(3)
    found = [combine_chi_squares(rng.chisquare(DOF, 1), DOF) for _ in range(500)]
    assert kstest(found, "chi2", args=(DOF,)).pvalue > 1e-3
