"""Samples of a pixel: no two share a column or a row, and edges of any slope are caught."""

import numpy as np
import pytest

from harness.basics.arrays import FloatArray
from harness.basics.errors import OutOfDomain
from harness.sim.light.direct_image import MOST_SAMPLES, pixel_places, quarter_counts

SIDES = (1, 2, 3, 4, 5, 8, 12, 16)


def places(samples: int) -> FloatArray:
    return np.array([place for place, _ in pixel_places(samples)])


@pytest.mark.parametrize("samples", SIDES)
def test_no_column_and_no_row_is_shared(samples: int) -> None:
    strata = np.sort(places(samples) * samples**2 - 0.5, axis=0)
    expected = np.repeat(np.arange(samples**2)[:, None], 2, axis=1)
    np.testing.assert_allclose(strata, expected, atol=1e-9)


@pytest.mark.parametrize("samples", SIDES)
def test_quarters_are_counted(samples: int) -> None:
    quarters = [quarter for _, quarter in pixel_places(samples)]
    assert quarter_counts(samples) == tuple(map(quarters.count, range(4)))


def edges(count: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Half planes through a pixel, ``n.x < c``, and the share of it that they cover, exactly."""
    random = np.random.default_rng(0)
    angle = random.uniform(0.0, 2.0 * np.pi, count)
    normal = np.column_stack([np.cos(angle), np.sin(angle)])
    beyond = random.uniform(-0.5, 0.5, count)
    return normal, beyond + normal.sum(axis=1) / 2.0, covered(normal, beyond)


def covered(normal: FloatArray, beyond: FloatArray) -> FloatArray:
    """The integral of a trapezoid, which a pixel is along the normal of an edge."""
    long, short = np.sort(np.abs(normal), axis=1)[:, ::-1].T
    flat, half = 0.5 * (long - short), 0.5 * (long + short)
    away = np.minimum(np.abs(beyond), half)
    corner = np.where(away > flat, (half - away) ** 2 / (2.0 * long * short), 0.0)
    inside = np.where(away > flat, 0.5 - corner, away / long)
    return np.asarray(0.5 + np.sign(beyond) * inside)


def test_edges_of_any_slope_are_caught_better_than_by_chance_and_faster_than_the_root() -> None:
    normal, offset, exact = edges(4000)
    errors, chance = [], []
    for samples in (2, 4, 8, 16):
        found = (places(samples) @ normal.T < offset).mean(axis=0)
        errors.append(float(np.sqrt(np.mean((found - exact) ** 2))))
        chance.append(float(np.sqrt(np.mean(exact * (1.0 - exact)) / samples**2)))
    rate = np.polyfit(np.log([4, 16, 64, 256]), np.log(errors), 1)[0]
    # Without order the rate is -1/2, and of an area with an edge that is any slope -3/4 is the best there is.
    assert -0.85 < rate < -0.7
    assert all(error < 0.55 * by_chance for error, by_chance in zip(errors, chance, strict=True))


@pytest.mark.parametrize("samples", [0, -1, MOST_SAMPLES + 1])
def test_samples_out_of_range_are_refused(samples: int) -> None:
    with pytest.raises(OutOfDomain, match="samples"):
        pixel_places(samples)


def test_as_many_as_are_allowed_are_had() -> None:
    assert len(set(map(tuple, places(MOST_SAMPLES).tolist()))) == MOST_SAMPLES**2
