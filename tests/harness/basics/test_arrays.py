"""Means over blocks of pixels."""

import numpy as np
import pytest

from harness.basics.arrays import block_means


@pytest.mark.parametrize("shape", [(6, 9), (6, 9, 3), (7, 11, 1), (8, 10, 2)])
def test_a_mean_is_that_of_its_own_square_and_what_fills_none_is_left_out(shape: tuple[int, ...]) -> None:
    picture = np.random.default_rng(0).normal(size=shape)
    means = block_means(picture, 3)
    assert means.shape == (shape[0] // 3, shape[1] // 3, *shape[2:])
    for row, column in np.ndindex(means.shape[:2]):
        square = picture[3 * row : 3 * row + 3, 3 * column : 3 * column + 3]
        assert means[row, column] == pytest.approx(square.mean(axis=(0, 1)), abs=1e-15)


def test_bytes_do_not_overflow_and_single_pixels_are_themselves() -> None:
    picture = np.full((4, 4, 3), 255, np.uint8)
    assert np.all(block_means(picture, 2) == 255.0)
    assert np.array_equal(block_means(picture, 1), picture.astype(np.float64))
    assert block_means(picture, 5).shape == (0, 0, 3)
