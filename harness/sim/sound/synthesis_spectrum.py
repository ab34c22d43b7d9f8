"""A sum of decaying sines by its spectrum: modes that hardly die away, each a narrow bell of few bins.

A table of sines (``harness.sim.sound.synthesis_tables``) costs as much as its modes are long. Where many
last,
a transform is shorter, of any number of them: within a stretch of ``L`` samples a mode times a bell of
Gauss has a spectrum that is a bell again, also where its frequency is complex, so that some
``2 REACH + 1`` bins hold it; they are added up for all modes, transformed, and divided by the first bell
(Greengard and Lee, Accelerating the Nonuniform Fast Fourier Transform, SIAM Review 46(3), 2004).
Everything is in double precision; what is missing is bounded in closed form (``missing``).
"""

from functools import lru_cache

import numpy as np
from scipy.fft import next_fast_len

from harness.basics.arrays import AnyArray, BoolArray, FloatArray, read_only
from harness.basics.compiled import compiled
from harness.sim.sound.synthesis_kernels import MEMORY

STRETCH = 16_500
"""Samples of one transform, about: an eighth of three seconds."""

_TOGETHER = 8
"""Stretches transformed together, in registers side by side."""

MOST_DECAY = 4.0
"""Times the time constant that a stretch may last: the bells of what dies faster overlap their images."""

REACH = 13
"""Bins of a bell to each side of its nearest one."""

_LONGER = 1.5
"""Of a stretch, the samples of its transform, at least."""

_WIDTH = 1.6
"""Squared bins: a bell is ``exp(-x^2 / (4 width))`` at ``x`` bins from its middle. Wider ones have nearer
images, narrower ones more of them beyond ``REACH``; at this width both are below 1e-8."""


def may_be_added(dampings: FloatArray, samples: int, rate: float) -> BoolArray:
    """``(m,)``: which modes die slowly enough to be summed by their spectrum.

    Args:
        dampings: ``(m,)`` 1/s.
        samples: of the sound.
        rate: samples per second.
    """
    return np.asarray(dampings * (_stretch(samples) / rate) <= MOST_DECAY)


def add_modes(
    dampings: FloatArray, turns: FloatArray, weights: AnyArray, rate: float, sound: FloatArray
) -> float:
    """Add the sum of ``Im(weight exp((-damping + 2 pi i turns rate) t))`` to a sound.

    Args:
        dampings: ``(m,)`` 1/s, of modes that ``may_be_added``.
        turns: ``(m,)`` of the phase per sample, from 0 to half a turn.
        weights: ``(m,)`` complex, at the first sample.
        rate: samples per second.
        sound: ``(t,)``, C-contiguous, added to.

    Returns:
        The most that any sample lacks.
    """
    stretch = _stretch(len(sound))
    length = 2 * int(next_fast_len(int(np.ceil(0.5 * _LONGER * stretch)), real=True))
    rows = min(_TOGETHER, -(-len(sound) // stretch))
    bins = MEMORY.piece((rows, length // 2 + 1 + 2 * REACH), np.dtype(np.complex128))
    waves = MEMORY.piece((rows, length), np.dtype(np.float64))
    # Half of each: a real transform counts a bin and its mirror image.
    sizes = -0.5j * weights * _passed(dampings, turns, rate, stretch // 2)
    step = _passed(dampings, turns, rate, stretch)
    fades = dampings * (length / (2.0 * np.pi * rate))
    for begin in range(0, len(sound), rows * stretch):
        bins[:] = 0.0
        _spread(bins, sizes, step, length * turns, fades, _WIDTH)
        # The bins of real transforms of even length: what lies below the first or above the last, mirrored.
        last = bins.shape[1] - 2 * REACH - 1
        kept = bins[:, REACH : REACH + last + 1]
        kept[:, 1 : REACH + 1] += np.conj(bins[:, REACH - 1 :: -1])
        kept[:, last - REACH : last] += np.conj(bins[:, : REACH + last : -1])
        # The first and the last are their own mirror images.
        kept[:, [0, last]] *= 2.0
        np.fft.irfft(kept, length, axis=1, norm="forward", out=waves)
        for row, first in zip(waves, range(begin, len(sound), stretch), strict=False):
            _add_wave(row, _inverse_bell(stretch, length), sound[first : first + stretch])
    return float(np.abs(weights) @ missing(dampings * (stretch / rate), stretch, length))


def missing(decays: FloatArray, stretch: int, length: int) -> FloatArray:
    """``(m,)``: the most by which a sample misses a mode, of its size at the beginning of the stretch.

    Of the images of the bell (Poisson's sum) the nearest is largest at an end of the stretch; of the
    bins beyond ``REACH`` all are added up with one sign, where the bell that they are divided by is least.

    Args:
        decays: ``(m,)`` times the time constant that the stretch lasts, ``MOST_DECAY`` at most.
        stretch: samples.
        length: samples of the transform.
    """
    longer = length / stretch
    image = -4.0 * np.pi**2 * _WIDTH * (1.0 - 1.0 / longer)
    images = 2.02 * np.exp(image + decays * (longer - 1.0))
    fade = decays * longer / (2.0 * np.pi)
    away = REACH + 0.5 + np.arange(20.0)
    beyond = 2.0 * np.exp(-(away**2) / (4.0 * _WIDTH)).sum() / np.sqrt(4.0 * np.pi * _WIDTH)
    edge = fade**2 / (4.0 * _WIDTH) + np.pi**2 * _WIDTH / longer**2 - 0.5 * decays
    # Roundings of the transform, of a size of one, where the bell is least.
    rounding = 8.0 * np.finfo(np.float64).eps * np.log2(length) * np.exp(np.pi**2 * _WIDTH / longer**2)
    return np.asarray(images + beyond * np.exp(edge) + rounding)


def _stretch(samples: int) -> int:
    """Samples of each transform but the last, which may have fewer; even."""
    return 2 * -(-samples // (2 * max(1, round(samples / STRETCH))))


def _passed(dampings: FloatArray, turns: FloatArray, rate: float, samples: int) -> AnyArray:
    """``(m,)`` complex factor of some samples; the phase loses no whole turns to rounding."""
    angle = samples * turns
    return np.asarray(np.exp(-dampings * (samples / rate) + 2j * np.pi * (angle - np.rint(angle))))


@lru_cache(maxsize=4)
def _inverse_bell(stretch: int, length: int) -> FloatArray:
    """``(stretch,)``: by what a transform is multiplied, sample after sample of its stretch."""
    place = (np.arange(stretch) - stretch // 2) / length
    return read_only(np.exp(4.0 * np.pi**2 * _WIDTH * place**2))


@compiled
def _add_wave(wave: FloatArray, inverse: FloatArray, sound: FloatArray) -> None:
    """Add a transform, whose first sample is the middle of its stretch, divided by its bell."""
    half = len(inverse) // 2
    before = min(half, len(sound))
    for at in range(before):
        sound[at] += wave[len(wave) - half + at] * inverse[at]
    for at in range(before, len(sound)):
        sound[at] += wave[at - half] * inverse[at]


@compiled
def _spread(
    bins: AnyArray, sizes: AnyArray, step: AnyArray, places: FloatArray, fades: FloatArray, width: float
) -> None:
    """Add every mode's bell to the bins around its place, in every stretch.

    Args:
        bins: ``(stretches, n + 2 REACH)``, bin 0 at ``REACH``.
        sizes: ``(m,)`` complex, at the middle of the first stretch; left as of the one after the last.
        step: ``(m,)`` its factor from one stretch to the next.
        places: ``(m,)`` bins.
        fades: ``(m,)`` imaginary part of the same.
        width: as ``_WIDTH``.
    """
    wide = 2 * REACH + 1
    bell = np.empty(wide, dtype=np.complex128)
    norm = 1.0 / np.sqrt(4.0 * np.pi * width)
    curve = np.exp(-0.5 / width)
    for mode in range(len(sizes)):
        nearest = int(np.rint(places[mode]))
        x = nearest - REACH - places[mode] - 1j * fades[mode]
        value, ratio = norm * np.exp(-x * x / (4.0 * width)), np.exp(-(2.0 * x + 1.0) / (4.0 * width))
        for at in range(wide):
            bell[at] = value
            value *= ratio
            ratio *= curve
        for stretch in range(len(bins)):
            for at in range(wide):
                bins[stretch, nearest + at] += sizes[mode] * bell[at]
            sizes[mode] *= step[mode]
