"""Beliefs about a size: what they say of a known density, and what a product of them does."""

import numpy as np
import pytest

from experiments.scale_estimation.size import ENDS, SHARED, STEP, Belief, SizeRange, add_unevenness, fused
from harness.basics.errors import OutOfDomain

RANGE = SizeRange(0.05, 0.4)


def normal(size: float, sigma: float) -> Belief:
    return Belief.of(RANGE, -0.5 * ((RANGE.logs - np.log(size)) / sigma) ** 2)


@pytest.mark.parametrize("sigma", [0.005, 0.02, 0.1])
def test_a_normal_density_has_its_own_median_width_and_interval(sigma: float) -> None:
    belief = normal(0.15, sigma)
    assert belief.size == pytest.approx(0.15, rel=STEP / 2)
    assert belief.spread == pytest.approx(sigma, rel=0.02)
    low, high = np.log(belief.interval) - np.log(0.15)
    assert low == pytest.approx(-1.645 * sigma, abs=STEP)
    assert high == pytest.approx(1.645 * sigma, abs=STEP)


def test_knowing_nothing_is_the_whole_range() -> None:
    belief = Belief.ignorant(RANGE)
    low, high = belief.interval
    assert np.log(high / low) == pytest.approx(0.9 * (np.log(0.4 / 0.05) + 2.0 * ENDS), abs=3 * STEP)
    assert belief.outside == 0.0


def test_independent_senses_narrow_each_other_as_normal_densities_do() -> None:
    together = fused([normal(0.150, 0.02), normal(0.153, 0.01)])
    narrowed = 1.0 / np.hypot(50.0, 100.0)
    assert together.spread == pytest.approx(np.hypot(narrowed, SHARED), rel=0.05)
    weighed = (np.log(0.150) / 0.02**2 + np.log(0.153) / 0.01**2) / (1 / 0.02**2 + 1 / 0.01**2)
    assert together.size == pytest.approx(float(np.exp(weighed)), rel=1e-3)


def test_no_number_of_senses_is_surer_than_what_they_err_by_alike() -> None:
    assert fused([normal(0.150, 0.004)] * 50).spread >= SHARED


def test_one_wrong_sense_does_not_outvote_two_that_agree() -> None:
    together = fused([normal(0.15, 0.02), normal(0.151, 0.02), normal(0.3, 0.002)])
    assert together.size == pytest.approx(0.15, rel=0.02)


def test_order_does_not_matter_and_one_alone_is_itself() -> None:
    one, two, three = normal(0.1, 0.02), normal(0.12, 0.05), normal(0.11, 0.1)
    assert np.allclose(fused([one, two, three]).log_density, fused([three, one, two]).log_density)
    assert fused([one]) is one


def test_an_error_on_top_adds_in_squares() -> None:
    assert normal(0.15, 0.03).widened(0.04).spread == pytest.approx(0.05, rel=0.02)
    assert normal(0.15, 0.03).widened(0.0).spread == pytest.approx(0.03, rel=0.02)


@pytest.mark.parametrize("size", [0.06, 0.15, 0.35])
def test_an_uneven_object_is_longer_than_its_model_and_its_size_less_certain(size: float) -> None:
    made = add_unevenness(normal(size, 0.005))
    assert made.size - size == pytest.approx(0.15e-3, abs=0.02e-3)
    assert made.spread * size == pytest.approx(np.hypot(0.005 * size, 0.35e-3), rel=0.03)


def test_unevenness_leaves_open_what_was_open() -> None:
    before, after = (Belief.ignorant(RANGE), add_unevenness(Belief.ignorant(RANGE)))
    assert np.ptp(np.log(after.interval)) == pytest.approx(np.ptp(np.log(before.interval)), abs=0.02)
    assert after.spread == pytest.approx(before.spread, rel=0.01)


def test_a_size_beyond_the_range_is_seen_there() -> None:
    belief = normal(0.55, 0.02)
    assert belief.outside > 0.99
    assert belief.size == pytest.approx(0.4, rel=ENDS + STEP)  # the nearest that was asked about
    assert np.isfinite(belief.interval).all()


@pytest.mark.parametrize("sigma", [0.02, 0.1, 0.3])
@pytest.mark.parametrize("end", [RANGE.low, RANGE.high])
def test_an_object_made_at_the_end_of_the_range_and_a_little_off_is_in_the_interval(
    end: float, sigma: float
) -> None:
    for off in (-0.005, 0.005):
        low, high = normal(end, sigma).interval
        assert low <= end * (1.0 + off) <= high
        assert normal(end * (1.0 + off), 0.002).outside < 0.05


def test_what_is_no_density_is_refused() -> None:
    count = len(RANGE.logs)
    for density in (np.zeros(count - 1), np.full(count, np.nan), np.full(count, -np.inf)):
        with pytest.raises(OutOfDomain, match=r"density.* 3467 sizes"):
            Belief.of(RANGE, density)
    with pytest.raises(OutOfDomain):
        fused([])
    for low, high in ((0.0, 1.0), (0.2, 0.1), (0.1, np.inf)):
        with pytest.raises(OutOfDomain, match=r"0\.0 to 1\.0 m|0\.2 to 0\.1 m|0\.1 to inf m"):
            SizeRange(low, high)
