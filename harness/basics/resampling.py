"""A band-limited signal at other times than it was sampled at.

Sinc interpolation under a Kaiser window (Smith and Gossett, "A flexible sampling-rate conversion
method", ICASSP 1984): exact for what the samples hold up to 0.45 of the lower of the two rates,
to 100 dB.
"""

from functools import lru_cache

import numpy as np

from harness.basics.arrays import FloatArray, read_only

HALF_WIDTH = 32
"""Samples of the lower rate on either side that a value is made from."""

_PHASES = 1024
_KAISER_BETA = 10.0
_SAME_RATE = 1e-3


def resample(
    samples: FloatArray, start: float, rate: float, times: FloatArray, new_rate: float
) -> FloatArray:
    """The signal's values at ``times``.

    Args:
        samples: ``(n,)`` evenly spaced, of any unit.
        start: s, of the first.
        rate: Hz, of the samples.
        times: ``(t,)`` s, between the first and the last sample. Within ``HALF_WIDTH`` samples of
            either end the missing neighbours are taken to be like the last one there is.
        new_rate: Hz, of ``times``; where it is lower, what it cannot hold is filtered out.

    Returns:
        ``(t,)`` in the unit of the samples.

    Raises:
        ValueError: a time before the first sample or after the last.
    """
    positions = (times - start) * rate
    if len(positions) and (positions.min() < -1e-6 or positions.max() > len(samples) - 1 + 1e-6):
        raise ValueError(f"times leave the {len(samples)} samples there are; leave out what is not shared")
    ratio = new_rate / rate
    kernels, half = _kernels(1.0 if ratio > 1.0 - _SAME_RATE else ratio)
    whole = np.floor(positions).astype(np.int64)
    phase, rest = np.divmod((positions - whole) * _PHASES, 1.0)
    row = np.minimum(phase.astype(np.int64), _PHASES - 1)
    padded = np.pad(samples, half, mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * half)
    near = windows[np.clip(whole + 1, 0, len(windows) - 1)]
    before = np.einsum("tk,tk->t", near, kernels[row])
    after = np.einsum("tk,tk->t", near, kernels[row + 1])
    value: FloatArray = before + rest * (after - before)
    return value


@lru_cache(maxsize=8)
def _kernels(cutoff: float) -> tuple[FloatArray, int]:
    """``(phases + 1, 2 half)`` weights by the fraction of a sample asked for, each summing to one."""
    half = int(np.ceil(HALF_WIDTH / cutoff))
    offsets = np.arange(1 - half, half + 1)[None, :] - np.linspace(0.0, 1.0, _PHASES + 1)[:, None]
    window = np.i0(_KAISER_BETA * np.sqrt(np.maximum(0.0, 1.0 - (offsets / half) ** 2)))
    weights = np.sinc(cutoff * offsets) * window
    return read_only(weights / weights.sum(axis=1, keepdims=True)), half
