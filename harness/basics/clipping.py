"""Whether a converter ran out of range, from the signal alone."""

import numpy as np

from harness.basics.arrays import AnyArray


def is_clipped(signal: AnyArray, above_only: bool = False) -> bool:
    """Whether a signal stays at its greatest or least value as only a full scale makes it.

    Three samples and more of one value, entered by a step of more than four of the smallest steps in the
    signal: a smooth maximum that is merely coarsely counted is entered by one or two.

    Args:
        signal: ``(t,)``.
        above_only: whether the least value may be held, as a force's rest is.
    """
    values = np.asarray(signal, np.float64)
    steps = np.abs(np.diff(values))
    if not steps.any():
        return False
    smallest = float(steps[steps > 0.0].min())
    extremes = (values.max(),) if above_only else (values.max(), values.min())
    for extreme in extremes:
        held = np.concatenate([[False], values == extreme, [False]])
        edges = np.flatnonzero(np.diff(held.astype(np.int8)))
        for begin, end in zip(edges[::2], edges[1::2], strict=True):
            into = steps[begin - 1] if begin > 0 else 0.0
            out = steps[end - 1] if end < len(values) else 0.0
            if end - begin >= 3 and max(into, out) > 4.0 * smallest:
                return True
    return False
