"""Distances between pictures: laws that any of them keeps."""

import numpy as np
import pytest

from harness.basics.errors import OutOfDomain
from harness.picture.image_metrics import psnr, ssim

PICTURE = np.random.default_rng(0).integers(0, 256, (40, 50, 3)).astype(np.uint8)


def _noisy(sigma: float) -> np.ndarray:
    noise = np.random.default_rng(1).normal(0.0, sigma, PICTURE.shape)
    return np.asarray(PICTURE + noise)


def test_a_picture_is_its_own_likeness() -> None:
    assert ssim(PICTURE, PICTURE) == pytest.approx(1.0)
    assert psnr(PICTURE, PICTURE) == np.inf


def test_more_noise_is_less_alike() -> None:
    by_noise = [ssim(PICTURE, _noisy(sigma)) for sigma in (1.0, 5.0, 20.0, 80.0)]
    assert sorted(by_noise, reverse=True) == by_noise
    assert by_noise[0] < 1.0


def test_neither_picture_is_the_first() -> None:
    other = _noisy(20.0)
    assert ssim(PICTURE, other) == pytest.approx(ssim(other, PICTURE))


def test_flat_pictures_differ_by_their_levels_alone() -> None:
    """Without structure equation 13 is its first factor, ``(2ab + c) / (a^2 + b^2 + c)``."""
    a, b, c = 100.0, 120.0, (0.01 * 255.0) ** 2
    flat = np.ones((30, 30, 3))
    assert ssim(a * flat, b * flat) == pytest.approx((2 * a * b + c) / (a * a + b * b + c))


def test_pictures_of_two_sizes_are_refused() -> None:
    with pytest.raises(OutOfDomain, match=r"\(\d+, \d+.* \(\d+, \d+"):
        ssim(PICTURE, PICTURE[1:])


def test_likeness_of_a_part_is_of_that_part() -> None:
    """And parts make up the whole."""
    other, left = _noisy(20.0), np.zeros(PICTURE.shape[:2], bool)
    left[:, :20] = True
    other[:, 30:] = PICTURE[:, 30:]
    parts = [ssim(PICTURE, other, where) for where in (left, ~left)]
    assert parts[0] < parts[1]
    assert 0.4 * parts[0] + 0.6 * parts[1] == pytest.approx(ssim(PICTURE, other))
    with pytest.raises(OutOfDomain, match="no pixel"):
        ssim(PICTURE, other, left & ~left)
    with pytest.raises(OutOfDomain, match=r"\(\d+, \d+.* \(\d+, \d+"):
        ssim(PICTURE, other, left[1:])
