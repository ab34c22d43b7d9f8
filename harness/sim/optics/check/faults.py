"""Faults that a picture shows without any model of its gel: no light, lost parts, clipping, noise."""

import numpy as np

from harness.basics.arrays import BoolArray, ByteArray, FloatArray
from harness.basics.errors import PictureRefused

_LOST = 8
"""Pixels a side of a square that is one colour to the last bit: no camera's noise leaves one."""

_DARKEST = 0.62
"""Of the resting gel in every channel, that a press leaves of a block's light; real presses leave 0.77."""

_MOST_DARK = 0.02
_MOST_LOST = 0.01
_NO_LIGHT = 0.2
_MOST_CLIPPED = 0.08
"""Share of values clipped beyond those of the calibration's background; real presses have up to 0.06."""

_MOST_NOISE = 12.0
"""Grey levels from pixel to pixel: camera noise of 9."""


def require_light(seen: FloatArray, known: FloatArray) -> None:
    """Refuse a picture that is all but black beside its calibration's resting one.

    Args:
        seen: ``(rows, columns, 3)`` grey levels, means over blocks.
        known: the same, of the calibration's background.

    Raises:
        PictureRefused: with the share of the light.
    """
    left = float(seen.sum() / max(float(known.sum()), 1.0))
    if left < _NO_LIGHT:
        raise PictureRefused(
            f"the picture has {left:.0%} of the calibration's light (at least {_NO_LIGHT:.0%}): the sensor's "
            "lights are off, or the camera sent no picture; check its cable and exposure"
        )


def require_whole(image: ByteArray, known: ByteArray) -> None:
    """Refuse a picture of which a part was lost on its way.

    Args:
        image: ``(rows, columns, 3)`` RGB.
        known: the same, of the resting gel.

    Raises:
        PictureRefused: with the share of the picture and what to do.
    """
    flat = _flat(image)
    lost = float((flat & ~_flat(known)).mean()) if flat.any() else 0.0
    if lost > _MOST_LOST:
        raise PictureRefused(
            f"{lost:.0%} of the picture is one colour without any noise (at most {_MOST_LOST:.0%}): part of "
            "the frame was lost on its way; take another"
        )


def require_unclipped(image: ByteArray, known: ByteArray) -> None:
    """Refuse a picture of which far more is clipped than of its calibration's background.

    Args:
        image: ``(rows, columns, 3)`` RGB.
        known: the same, of the calibration's background.

    Raises:
        PictureRefused: with the share of the values.
    """
    clipped = _clipped(image) - _clipped(known)
    if clipped > _MOST_CLIPPED:
        raise PictureRefused(
            f"{clipped:.0%} more of the picture's values are at 0 or 255 than of the calibration's (at most "
            f"{_MOST_CLIPPED:.0%}): set exposure and gain as they were at the calibration"
        )


def require_quiet(image: ByteArray, rest: ByteArray) -> None:
    """Refuse colours that jump from pixel to pixel as a bad cable's do, or a camera's without light.

    Args:
        image: ``(rows, columns, 3)`` RGB.
        rest: the same, of the resting gel.

    Raises:
        PictureRefused: with the jump in grey levels.
    """
    jump = float(np.median(np.abs(np.diff(image[::8].astype(np.int16) - rest[::8], axis=1))))
    if jump > _MOST_NOISE:
        raise PictureRefused(
            f"colours change by {jump:.0f} grey levels from pixel to pixel in the median (at most "
            f"{_MOST_NOISE:.0f}): the picture is noise; check light, gain and cable, or average more frames"
        )


def require_lit(seen: FloatArray, rest: FloatArray) -> None:
    """Refuse a picture of which a part is darker or brighter in every channel than a press makes a gel.

    Args:
        seen: ``(rows, columns, 3)`` grey levels, means over blocks.
        rest: the same, of the resting gel in the light of the moment.

    Raises:
        PictureRefused: with the share of the picture.
    """
    ratio = (seen + 1.0) / (rest + 1.0)
    dark = float((ratio.max(axis=2) < _DARKEST).mean())
    bright = float((ratio.min(axis=2) > 1.0 / _DARKEST).mean())
    if max(dark, bright) > _MOST_DARK:
        raise PictureRefused(
            f"{max(dark, bright):.0%} of the picture is {'darker' if dark > bright else 'brighter'} in every "
            f"channel than a press makes the gel (beyond a factor of {_DARKEST:g}): part of the lights "
            "is off, something lies before the camera, or press and rest are of different lights"
        )


def _flat(image: ByteArray) -> BoolArray:
    """``(rows, columns)`` of the squares that are one colour to the last bit."""
    rows, columns = image.shape[0] // _LOST, image.shape[1] // _LOST
    strips = image[: rows * _LOST, : columns * _LOST].reshape(rows, _LOST, -1)
    shape = (rows, columns, _LOST, 3)
    least, most = strips.min(axis=1), strips.max(axis=1)
    if not (least == most).any():
        return np.zeros((rows, columns), np.bool_)
    least, most = least.reshape(shape), most.reshape(shape)
    return np.asarray((least.min(axis=2) == most.max(axis=2)).all(axis=2))


def _clipped(image: ByteArray) -> float:
    return np.count_nonzero((image == 0) | (image == 255)) / image.size
