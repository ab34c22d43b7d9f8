"""Means over blocks of pixels, and keys of rows."""

import numpy as np
import pytest

from harness.basics.arrays import IntArray, block_means, row_keys


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


@pytest.mark.parametrize(
    "rows",
    [
        np.random.default_rng(0).integers(0, 9, (200, 2)),
        np.random.default_rng(1).integers(-4, 5, (200, 3)),
        np.array([[2**40, -(2**40), 3], [0, 0, 0], [2**40, -(2**40), 3]]),
        np.array([[3, 1], [1, 3]], np.uint64),
        np.zeros((0, 3), np.int64),
    ],
    ids=["of two", "negative", "beyond 64 bits", "unsigned", "none"],
)
def test_keys_are_equal_and_in_order_as_the_rows_are(rows: IntArray) -> None:
    unique, inverse = np.unique(rows, axis=0, return_inverse=True)
    _, first, by_key = np.unique(row_keys(rows), return_index=True, return_inverse=True)
    np.testing.assert_array_equal(rows[first], unique)
    np.testing.assert_array_equal(by_key, inverse.reshape(-1))
