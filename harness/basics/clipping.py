"""Detect that a converter or an amplifier ran out of range, from the signal alone."""

import numpy as np

from harness.basics.arrays import AnyArray, BoolArray, FloatArray

_MIN_HELD = 3
"""Samples of one value."""

_MIN_FLAT = 4
"""Samples within ``_FLAT`` of the extreme."""

_FLAT = 0.01
"""Fraction of the extreme, above the median, within which a noisy plateau lies."""

_MIN_CORNER = 25.0
"""Length of a plateau in samples, times the step into it over ``_FLAT``. A parabola has 4, a flatter smooth
maximum up to 8."""


def is_clipped(signal: AnyArray, above_only: bool = False) -> bool:
    """Return whether a signal stays at its greatest or least value as only a limited range makes it.

    Two kinds of flat tops count, at any level: three samples and more of exactly one value, entered by a step
    of more than four of the smallest steps in the signal (a smooth maximum that is merely coarsely counted is
    entered by one or two); and four samples and more within one per cent of the extreme, entered by a corner
    (an amplifier that saturates in front of a converter with noise of its own).

    Args:
        signal: ``(t,)``.
        above_only: whether only the greatest value is looked at, because a force rests at its least.
    """
    values = np.asarray(signal, np.float64)
    steps = np.abs(np.diff(values))
    if not steps.any():
        return False
    smallest = float(steps[steps > 0.0].min())
    middle = float(np.median(values))
    for extreme in (values.max(),) if above_only else (values.max(), values.min()):
        flat = _FLAT * abs(float(extreme) - middle)
        for length, step in _runs(values == extreme, steps):
            if length >= _MIN_HELD and step > 4.0 * smallest:
                return True
        for length, step in _runs(np.abs(values - extreme) <= flat, steps):
            if length >= _MIN_FLAT and step > 4.0 * smallest and length * step > _MIN_CORNER * flat > 0.0:
                return True
    return False


def _runs(chosen: BoolArray, steps: FloatArray) -> list[tuple[int, float]]:
    """Return the length of each run of chosen samples and the greater of the steps at its ends."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], chosen, [False]]).astype(np.int8)))
    return [
        (
            int(end - begin),
            max(
                float(steps[begin - 1]) if begin > 0 else 0.0,
                float(steps[end - 1]) if end <= len(steps) else 0.0,
            ),
        )
        for begin, end in zip(edges[::2], edges[1::2], strict=True)
    ]
