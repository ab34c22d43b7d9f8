"""What networks are given of strikes: how much rings in bands of the wave number, early and late.

Bands are of frequency over the material's sqrt(E / density), 1/m: twice as large an object has the same bands
an octave lower, whatever it is made of.
"""

from collections.abc import Sequence

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft, rfftfreq

from harness.basics.arrays import BoolArray, FloatArray
from harness.basics.materials import MATERIALS, Material
from harness.bench.acquisition import Strike
from harness.strikes.spectra import Analysis, spectra_of

FRAMES = ((0.0, 0.016), (0.012, 0.04), (0.03, 0.1), (0.08, 0.3))
"""S after the strike, from and to."""

BANDS = 192
_EDGES = np.geomspace(0.025, 14.0, BANDS + 1)
"""1/m."""

FLOOR = 60.0
"""DB below the loudest band of all frames."""

CHANNELS = len(FRAMES) + 1
EXTRAS = 2 + len(MATERIALS)
"""Beside the bands: their level, how many strikes, and one number a material."""


def response_of(strikes: Sequence[Strike]) -> tuple[FloatArray, float, tuple[float, float]] | None:
    """``(k, t)`` Pa/(N s) impulse responses, windowed as ``Analysis`` says, their rate and band in Hz.

    None where no strike may be used, or the hammer excited nothing.
    """
    usable = [strike for strike in strikes if not strike.fault]
    if not usable:
        return None
    settings = Analysis()
    spectra = spectra_of(usable, settings)
    excited = spectra.frequencies[spectra.excited.all(axis=0)]
    if len(excited) < 2:
        return None
    rate = usable[0].rate
    responses = irfft(spectra.transfer, axis=1) * rate
    return responses[:, : round(settings.duration * rate)], rate, (float(excited[0]), float(excited[-1]))


def features(
    responses: FloatArray, rate: float, band: tuple[float, float], material: Material
) -> tuple[FloatArray, FloatArray]:
    """``(CHANNELS, BANDS)`` and ``(EXTRAS,)``.

    Args:
        responses: ``(k, t)`` Pa/(N s), of one strike each.
        rate: Hz.
        band: Hz, that was excited.
        material: that the object is said to be of.
    """
    _, inside = bands_of(band, material)
    level, loudest = levels_of(responses, rate, inside, material)
    bands = np.vstack([np.where(inside, 1.0 + level / FLOOR, 0.0), inside[None].astype(np.float64)])
    one_hot = np.array([name == material.name for name in MATERIALS], dtype=np.float64)
    return bands, np.concatenate([[0.3 * np.log10(loudest), 0.3 * len(responses)], one_hot])


def bands_of(band: tuple[float, float], material: Material) -> tuple[FloatArray, BoolArray]:
    """``(BANDS,)`` Hz, the middles; which of them were excited."""
    middles = np.sqrt(_EDGES[1:] * _EDGES[:-1]) * material.speed
    return middles, (middles >= band[0]) & (middles <= band[1])


def levels_of(
    responses: FloatArray, rate: float, inside: BoolArray, material: Material
) -> tuple[FloatArray, float]:
    """``(FRAMES, BANDS)`` dB below the loudest, and its power."""
    edges = _EDGES * material.speed
    powers = np.array([_band_powers(responses, rate, frame, edges) for frame in FRAMES])
    powers = np.where(inside, powers, 0.0)
    loudest = max(float(powers.max()), 1e-30)
    return 10.0 * np.log10(np.maximum(powers / loudest, 10.0 ** (-0.1 * FLOOR))), loudest


def _band_powers(
    responses: FloatArray, rate: float, frame: tuple[float, float], edges: FloatArray
) -> FloatArray:
    """``(BANDS,)`` of the frame, mean over the strikes; bands narrower than a line take a share of it."""
    first, last = (min(round(end * rate), responses.shape[1]) for end in frame)
    piece = responses[:, first:last] * np.hanning(last - first)
    size = next_fast_len(2 * (last - first), real=True)
    power = (np.abs(rfft(piece, size, axis=1)) ** 2).mean(axis=0)
    lines = rfftfreq(size, 1.0 / rate)
    below = np.append(0.0, np.cumsum(power)) * (lines[1] / rate**2)
    ends = np.append(lines - 0.5 * lines[1], lines[-1] + 0.5 * lines[1])
    return np.diff(np.interp(edges, ends, below))
