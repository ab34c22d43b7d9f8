"""Where a ball first touched does not depend on the lights, and its middle at depth does."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from calibration.taxim.arm.touch_down import PICTURES, WAYS, touch_downs
from harness.basics.arrays import FloatArray

BALL, ROWS, COLUMNS = 16.0, 90, 120
NONE, STRONG = 0.0, 0.03
BETTER = 0.12
"""Pixels: half of what an arm repeats a pose to (0.03 mm), which is taken to be the greater error."""

FINE = 4
"""Sub-pixels a side: an edge is where it is, and not where pixels end."""

DEPTHS = 0.6 + 0.8 * np.arange(PICTURES)


def descent(x: float, y: float, uneven: float, noise: float = 0.0, seed: int = 0) -> FloatArray:
    """Pictures of a ball sinking in at a place; depths in pixels.

    Two lights from left and from above; ``uneven`` is the share by which each grows from a pixel to the next.
    """
    fine = (np.arange(max(ROWS, COLUMNS) * FINE) + 0.5) / FINE - 0.5
    columns, rows = np.meshgrid(fine[: COLUMNS * FINE], fine[: ROWS * FINE])
    right, down = columns - x, rows - y
    away = np.hypot(right, down)
    pictures = []
    for depth in DEPTHS:
        touched = (away**2 < depth * (2.0 * BALL - depth)) * (1.0 + uneven * right) * 80.0 / BALL
        change = np.stack([touched * right, touched * down, 0.5 * touched * (down - right)], axis=2)
        pixels = change.reshape(ROWS, FINE, COLUMNS, FINE, 3).mean(axis=(1, 3))
        pictures.append(gaussian_filter(pixels, (1.0, 1.0, 0.0)))
    drawn = np.array(pictures, dtype=np.float64)
    return np.asarray(drawn + np.random.default_rng(seed).normal(0.0, noise, drawn.shape))


def middle_at_depth(change: FloatArray) -> FloatArray:
    strength = np.sqrt((change[-1] ** 2).sum(axis=2))
    rows, columns = np.mgrid[:ROWS, :COLUMNS]
    weighed = [float((strength * columns).sum()), float((strength * rows).sum())]
    return np.array(weighed) / float(strength.sum())


@pytest.mark.parametrize("place", [(60.0, 45.0), (31.4, 60.7), (88.6, 30.2)])
def test_even_light_shows_the_place_by_every_way(place: tuple[float, float]) -> None:
    for seen in touch_downs([descent(*place, NONE)], BALL)[0]:
        assert seen[0] == pytest.approx(place, abs=BETTER)


def test_uneven_light_moves_the_middle_and_hardly_the_touch() -> None:
    place = (60.3, 44.6)
    change = descent(*place, STRONG)
    wrong = np.hypot(*(middle_at_depth(change) - place))
    assert wrong > 0.8
    for seen in touch_downs([change], BALL)[0]:
        assert np.hypot(*(seen[0] - place)) < 0.25 * wrong


def test_noise_of_a_grey_level_moves_it_by_less_than_a_fifth_of_a_pixel() -> None:
    place = (52.7, 40.1)
    each = touch_downs([descent(*place, NONE, 1.0, seed) for seed in range(12)], BALL)[0]
    for way, seen in zip(WAYS, each, strict=True):
        if way.degree == 1:
            assert np.std(seen, axis=0).max() < 0.2


def test_moving_the_ball_moves_the_touch_as_far() -> None:
    here, there = descent(40.25, 35.5, STRONG), descent(73.5, 52.75, STRONG)
    for seen in touch_downs([here, there], BALL)[0]:
        assert seen[1] - seen[0] == pytest.approx([33.25, 17.25], abs=0.08)


def test_nothing_seen_is_not_a_place() -> None:
    still = np.zeros((PICTURES, ROWS, COLUMNS, 3))
    none = np.zeros((0, ROWS, COLUMNS, 3))
    for seen in touch_downs([still, none, descent(60.0, 45.0, NONE)[:2]], BALL)[0]:
        assert np.isnan(seen).all()
    assert all(seen.shape == (0, 2) for seen in touch_downs([], BALL)[0])
