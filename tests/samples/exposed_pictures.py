"""Simulated pictures, and what a camera of known gains, offsets and noise would make of them."""

import numpy as np
from scipy.ndimage import gaussian_filter

from harness.basics.arrays import BoolArray, ByteArray, FloatArray
from harness.picture.linear_image import LinearImage
from harness.picture.srgb import bytes_from_linear

GAIN = np.array([0.62, 0.8, 0.71])
OFFSET = np.array([0.02, 0.03, 0.01])
BENCH = np.array([0.05, 0.09, 0.3])


def shaded(seed: int, rows: int = 96, columns: int = 96) -> FloatArray:
    """``(rows, columns, 3)`` smooth linear light of 0.05 to 0.95."""
    rough = np.random.default_rng(seed).normal(size=(rows, columns, 3))
    return np.clip(0.45 + 3.5 * gaussian_filter(rough, (6.0, 6.0, 0.0)), 0.05, 0.95)


def disc(rows: int, columns: int, radius: float, off: tuple[float, float] = (0.0, 0.0)) -> FloatArray:
    """``(rows, columns)`` coverage by a disc about the picture's middle, moved by (down, right) pixels."""
    i, j = np.mgrid[:rows, :columns] + 0.5
    away = np.hypot(i - 0.5 * rows - off[0], j - 0.5 * columns - off[1])
    return np.asarray(np.clip(radius - away + 0.5, 0.0, 1.0))


def pictured(seed: int = 0, radius: float = 36.0, off: tuple[float, float] = (0.0, 0.0)) -> LinearImage:
    """A shaded disc before nothing."""
    alpha = disc(96, 96, radius, off)
    return LinearImage(shaded(seed) * alpha[..., None], alpha, np.where(alpha > 0.0, 1.0, np.inf))


def taken(
    image: LinearImage,
    noise: float = 0.004,
    seed: int = 1,
    gain: FloatArray = GAIN,
    offset: FloatArray = OFFSET,
) -> ByteArray:
    """The camera's picture of it before a blue bench."""
    light = gain * image.colour + offset * image.alpha[..., None] + (1.0 - image.alpha)[..., None] * BENCH
    return bytes_from_linear(light + np.random.default_rng(seed).normal(0.0, noise, light.shape))


def bench_alone(image: LinearImage, noise: float = 0.004) -> ByteArray:
    """The same camera's picture of the bench without the object."""
    light = np.broadcast_to(BENCH, image.colour.shape)
    return bytes_from_linear(light + np.random.default_rng(2).normal(0.0, noise, light.shape))


def everywhere(light: FloatArray) -> BoolArray:
    """A mask of all."""
    return np.ones(light.shape[:2], bool)
