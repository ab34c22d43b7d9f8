"""What the paper's networks take: a crop of one picture, the spectrogram of one strike, imprints in order.

None of it says where the camera was, what the object is made of, or where the arm was.
"""

from collections.abc import Mapping, Sequence

import cv2
import numpy as np
from scipy.fft import rfft, rfftfreq

from experiments.scale_estimation.unseen import contact_set
from harness.basics.arrays import BoolArray, ByteArray, FloatArray, IntArray
from harness.basics.errors import FitRefused

SIDE = 64
"""Pixels along each side of a crop."""

FIELD = 0.64
"""Width of a crop in focal lengths: the same angle of view whatever the camera's pixels are."""

WINDOW = 8.0e-3
"""S of a frame of the spectrogram: lines lie 125 Hz apart."""

HOP = 4.0e-3
"""S from one frame to the next."""

LINES = 96
"""Of the spectrogram, from 125 Hz up to 12 kHz."""

FRAMES = 40

RANGE = 60.0
"""DB below a spectrogram's loudest point at which it ends."""

_UNIT = 30.0
"""DB that are 1 in the network's input."""

STEPS = contact_set.MOST
"""Imprints of a sequence; of more, the first."""

INPUTS: Mapping[str, tuple[tuple[str, tuple[int, ...]], ...]] = {
    "picture": (("crop", (3, SIDE, SIDE)),),
    "spectrogram": (("spectrogram", (1, LINES, FRAMES)),),
    "imprints": (("imprints", (STEPS, contact_set.IMPRINT)), ("last", (STEPS,))),
}
"""Names and shapes that each network takes."""


def crop_of(picture: ByteArray, mask: BoolArray, focal_px: float) -> FloatArray:
    """The picture about the object, what is behind it made black.

    Args:
        picture: ``(rows, columns, 3)`` RGB.
        mask: ``(rows, columns)`` the object's pixels.
        focal_px: pixels of the camera's focal length: how large an angle a pixel is. Its pose is not used.

    Returns:
        ``(3, SIDE, SIDE)``, 0 black to 1 white, times the share of a pixel that the object covers.

    Raises:
        FitRefused: the mask is empty.
    """
    if not mask.any():
        raise FitRefused("the object covers no pixel of the picture; put it where the camera sees it")
    side = max(1, round(FIELD * focal_px))
    shades = np.where(mask[..., None], picture / 255.0, 0.0)
    # A margin of the crop's own size: the object's middle lies in the picture, so no crop reaches beyond.
    padded = np.pad(shades, ((side, side), (side, side), (0, 0)))
    top, left = (side + _start(np.flatnonzero(mask.any(axis=axis)), side) for axis in (1, 0))
    window = padded[top : top + side, left : left + side]
    small = cv2.resize(window, (SIDE, SIDE), interpolation=cv2.INTER_AREA)
    return np.ascontiguousarray(small.transpose(2, 0, 1))


def _start(covered: IntArray, side: int) -> int:
    """Where a crop begins that has the covered rows or columns in its middle."""
    return round(0.5 * (int(covered[0]) + int(covered[-1]) + 1 - side))


def spectrogram_of(response: FloatArray, rate: float, band: tuple[float, float]) -> FloatArray:
    """Magnitudes of the short-time spectrum of one strike, in dB.

    Args:
        response: ``(t,)`` Pa/(N s), of one strike; silence follows its end.
        rate: Hz.
        band: Hz, that was excited; lines outside of it are empty.

    Returns:
        ``(1, LINES, FRAMES)`` dB re 1 Pa/N over 30; ``RANGE`` below the loudest point where it is quieter.

    Raises:
        FitRefused: nothing rings within the band.
    """
    length = round(WINDOW * rate)
    starts = np.round(np.arange(FRAMES) * HOP * rate).astype(int)
    long = np.append(response, np.zeros(max(0, int(starts[-1]) + length - len(response))))
    pieces = long[starts[:, None] + np.arange(length)] * np.hanning(length)
    magnitude = np.abs(rfft(pieces, axis=1)) / rate
    lines = rfftfreq(length, 1.0 / rate)
    wanted = np.arange(1, LINES + 1) / WINDOW
    inside = (wanted >= band[0]) & (wanted <= min(band[1], float(lines[-1])))
    levels = np.stack([np.interp(wanted, lines, frame) for frame in magnitude], axis=1) * inside[:, None]
    loudest = float(levels.max())
    if not loudest > 0.0:
        raise FitRefused(
            f"nothing rings from {band[0]:.0f} to {band[1]:.0f} Hz; strike a place of the object that rings"
        )
    decibels = 20.0 * np.log10(np.maximum(levels, loudest * 10.0 ** (-RANGE / 20.0)))
    return np.asarray(decibels[None] / _UNIT)


def sequence_of(imprints: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """``(STEPS, IMPRINT)`` extents of each imprint in the order of the presses; ``(STEPS,)`` 1 at the last.

    Args:
        imprints: ``(n, 3)`` m each, places of the object's surface in any frame.

    Raises:
        FitRefused: there is none.
    """
    if not imprints:
        raise FitRefused("the gel touched nothing yet")
    rows, kinds, _ = contact_set.imprint_features(imprints)
    last = np.zeros(STEPS)
    last[int(kinds[:, 0].sum()) - 1] = 1.0
    return rows, last
