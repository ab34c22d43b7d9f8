"""Light as a number that adds, and as pictures on disk and screens have it (sRGB, IEC 61966-2-1)."""

import numpy as np

from harness.basics.arrays import ByteArray, FloatArray, read_only

PEAK = 255.0


def linear_from_srgb(encoded: FloatArray) -> FloatArray:
    """Linear light of an encoded value, both 1 for white; any shape, the sign is kept."""
    size = np.abs(encoded)
    light = np.where(size <= 0.04045, size / 12.92, ((size + 0.055) / 1.055) ** 2.4)
    return np.copysign(light, encoded)


def srgb_from_linear(light: FloatArray) -> FloatArray:
    """The inverse of ``linear_from_srgb``."""
    size = np.abs(light)
    encoded = np.where(size <= 0.0031308, 12.92 * size, 1.055 * size ** (1.0 / 2.4) - 0.055)
    return np.copysign(encoded, light)


def bytes_from_linear(light: FloatArray) -> ByteArray:
    """Grey levels of 0 to 255 as a picture on disk has them; what is beyond black or white is clipped."""
    levels = np.rint(PEAK * srgb_from_linear(np.clip(light, 0.0, 1.0)))
    return read_only(levels.astype(np.uint8))


LINEAR_OF_BYTE: FloatArray = read_only(linear_from_srgb(np.arange(256) / PEAK))
"""``(256,)`` linear light of each grey level."""
