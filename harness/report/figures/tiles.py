"""Tactile images and height maps as small pictures, pixel for pixel."""

from io import BytesIO

import matplotlib as mpl
import numpy as np
from matplotlib.image import imsave

from harness.basics.arrays import AnyArray, ByteArray, FloatArray, block_means

DIFFERENCE_GAIN = 3.0
"""How much differences of images are amplified about middle grey."""

_LARGEST_WIDTH = 480


def difference(live: AnyArray, simulated: AnyArray) -> ByteArray:
    """Live less simulated, amplified, about middle grey."""
    apart = live.astype(np.float64) - simulated.astype(np.float64)
    return np.clip(127.5 + DIFFERENCE_GAIN * apart, 0.0, 255.0).astype(np.uint8)


def root_mean_square(live: AnyArray, simulated: AnyArray) -> float:
    """Difference of two images in grey levels of 255."""
    return float(np.sqrt(np.mean((live.astype(np.float64) - simulated.astype(np.float64)) ** 2)))


def height_picture(height: FloatArray, highest: float) -> ByteArray:
    """``(rows, columns, 3)`` of indentation in metres, dark at 0 and bright at ``highest``."""
    level = np.clip(height / highest, 0.0, 1.0) if highest > 0.0 else np.zeros_like(height)
    colours = mpl.colormaps["viridis"](level)[..., :3]
    return np.asarray(np.round(255.0 * colours), dtype=np.uint8)


def png(picture: AnyArray) -> bytes:
    """A PNG file of ``(rows, columns, 3)`` uint8 RGB, averaged down to at most 480 columns."""
    block = -(-picture.shape[1] // _LARGEST_WIDTH)
    file = BytesIO()
    imsave(file, np.round(block_means(picture, block)).astype(np.uint8), format="png")
    return file.getvalue()
