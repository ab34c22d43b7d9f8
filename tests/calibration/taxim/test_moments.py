"""Normal equations from moments: the same sums as those of the matrix of terms, which is written out here."""

import numpy as np
import pytest

from calibration.taxim.moments import OFFSET, SLOPES, Power, colour_terms, graded, place_products
from harness.basics.arrays import FloatArray
from harness.sim.optics.lit_calibration import LIGHT_POWERS, place_terms
from harness.sim.optics.shading import design
from tests.oracles.light_design import light_design

LIGHT: tuple[Power, ...] = tuple((a, b, 1) for a, b in LIGHT_POWERS)
PIXELS = 700
ROUNDOFF = 1e-13
"""Of the largest sum: a few times the pixels' square root, in units of double precision."""


def _pixels() -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    draw = np.random.default_rng(4)
    return (
        draw.uniform(-0.8, 0.8, (PIXELS, 2)),
        draw.uniform(-1.0, 1.0, (PIXELS, 2)),
        draw.uniform(0.0, 9.0, PIXELS),
        draw.uniform(0.0, 3.0, PIXELS),
        draw.normal(0.0, 40.0, (PIXELS, 3)),
    )


def _written_out(
    powers: tuple[Power, ...], normal: FloatArray, where: FloatArray, height: FloatArray
) -> FloatArray:
    if powers == SLOPES:
        return design(normal, where)
    if powers == SLOPES + OFFSET:
        return np.hstack([design(normal, where), place_terms(where)])
    return np.hstack([design(normal, where), light_design(normal, where) * height[:, None]])


@pytest.mark.parametrize(
    "powers", [SLOPES, SLOPES + OFFSET, SLOPES + LIGHT], ids=["slopes", "offset", "light"]
)
def test_moments_are_the_normal_equations_of_the_written_out_terms(powers: tuple[Power, ...]) -> None:
    normal, where, height, weight, seen = _pixels()
    terms = _written_out(powers, normal, where, height)
    by_moments = colour_terms(powers, normal, place_products(where), height)
    gram, right = by_moments.normal_equations(weight, seen)
    wanted = terms.T @ (weight[:, None] * terms)
    assert np.abs(gram - wanted).max() < ROUNDOFF * np.abs(wanted).max()
    wanted = terms.T @ (weight[:, None] * seen)
    assert np.abs(right - wanted).max() < ROUNDOFF * np.abs(wanted).max()


@pytest.mark.parametrize(
    "powers", [SLOPES, SLOPES + OFFSET, SLOPES + LIGHT], ids=["slopes", "offset", "light"]
)
def test_shades_are_the_terms_times_the_coefficients(powers: tuple[Power, ...]) -> None:
    normal, where, height, _, _ = _pixels()
    terms = _written_out(powers, normal, where, height)
    colours = np.random.default_rng(5).normal(0.0, 10.0, (terms.shape[1], 3))
    shown = colour_terms(powers, normal, place_products(where), height).shades(colours)
    assert shown == pytest.approx(terms @ colours, rel=1e-11, abs=1e-10)


def test_parts_add_up() -> None:
    """Sums over two halves of the pixels are the sums over all."""
    normal, where, height, weight, seen = _pixels()
    half = np.arange(PIXELS) % 2 == 0
    whole, *parts = (
        colour_terms(SLOPES + LIGHT, normal[k], place_products(where[k]), height[k]).normal_equations(
            weight[k], seen[k]
        )
        for k in (np.ones(PIXELS, np.bool_), half, ~half)
    )
    for one, first, second in zip(whole, *parts, strict=True):
        assert np.abs(one - first - second).max() < ROUNDOFF * np.abs(one).max()


def test_graded_products_start_with_those_of_any_lower_degree() -> None:
    draw = np.random.default_rng(6)
    first, second = draw.normal(size=(2, 30))
    high, low = graded(first, second, 6), graded(first, second, 4)
    assert np.array_equal(high[: len(low)], low)
    for total in range(7):
        for a in range(total + 1):
            row = total * (total + 1) // 2 + a
            assert high[row] == pytest.approx(first**a * second ** (total - a), rel=1e-12)


def test_a_fit_without_light_has_no_use_for_an_indentation() -> None:
    normal, where, _, weight, seen = _pixels()
    gram, right = colour_terms(SLOPES, normal, place_products(where)).normal_equations(weight, seen)
    assert gram.shape == (120, 120)
    assert right.shape == (120, 3)
    assert np.allclose(gram, gram.T)
