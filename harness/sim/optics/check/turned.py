"""Whether a press has its channels exchanged or its picture turned, by what explains it better.

A surface of the gel and the resting gel explain a press as it is. Where one of the other orders of channels
and orientations explains it far better, the picture is in that one. Contacts that fill the window, or are
steeper than the linear shading, are explained badly as they are, and worse in every other way.
"""

import numpy as np

from harness.basics.arrays import FloatArray, block_means
from harness.sim.optics.check.light import channel_orders, in_words, turns
from harness.sim.optics.check.slopes import surface_residual
from harness.sim.optics.tactile_calibration import TactileCalibration

_COARSER = 2
"""Blocks of the check averaged each way: a surface is told from none by its large parts."""

_FAR_BETTER = 0.8
"""Of the residual as it is: right presses have at least 1.4 in any other way, turned ones at most 0.6."""

_LITTLE, _SHARE = 6.0, 0.35
"""Grey levels, and share of the change, left unexplained by a press that needs no second look."""

_AS_GOOD = 1.1
"""Times the least residual: ways that cannot be told apart."""

_NO_MORE = 1.1
"""Times a press's change: a way in which the press differs by more from the rest than this is none."""

_UNCHANGED = 4.0
"""Grey levels within which a block is at rest."""

_STILL = 0.25
"""Share of a picture that is taken to be at rest."""

_OWN = np.arange(3)
"""Channels in their own order."""


def without_drift(change: FloatArray) -> FloatArray:
    """A change of colour less what its least changed quarter has in common, the light of the moment.

    Args:
        change: ``(rows, columns, 3)`` grey levels, means over blocks.
    """
    size = np.abs(change).max(axis=2)
    if (size < _UNCHANGED).mean() > _STILL:
        return change
    still = size <= np.percentile(size, 100.0 * _STILL)
    return np.asarray(change - np.median(change[still], axis=0))


def better_turned(
    seen: FloatArray, rest: FloatArray, calibration: TactileCalibration, block: int
) -> tuple[str, float, float] | None:
    """The order of channels and orientation that explain a press far better than it is; None for none.

    Args:
        seen: ``(rows, columns, 3)`` grey levels, means over blocks.
        rest: the same, of the untouched gel in the same light.
        calibration: with a smooth model.
        block: pixels a side of a block.

    Returns:
        In words, with the grey levels rms left unexplained in it and as it is.
    """
    own, coarse = _COARSER * block, block_means(rest, _COARSER)
    picture = block_means(seen, _COARSER)
    size, left = _size(picture - coarse), surface_residual(without_drift(picture - coarse), calibration, own)
    if left < min(_LITTLE, _SHARE * size):
        return None
    ways = {
        words: surface_residual(without_drift(other - coarse), calibration, own)
        for words, other in _nearer(picture, coarse, _NO_MORE * size)
    }
    least = min(ways.values(), default=np.inf)
    if least >= _FAR_BETTER * left:
        return None
    # On an evenly lit gel half a turn more explains as much; the plainest comes first.
    words = next(words for words, one in ways.items() if one < _AS_GOOD * least)
    return words, ways[words], left


def _nearer(picture: FloatArray, rest: FloatArray, limit: float) -> list[tuple[str, FloatArray]]:
    """The picture in every other way, in words, in which it is by less than ``limit`` from the rest.

    ``_size`` of the difference, by products of channels, which all orders of an orientation share.
    """
    count, every, orders = picture.size / 3, turns(picture, back=True), channel_orders(back=True)
    taken = np.array([channels for _, channels in orders])
    products = np.stack([np.einsum("ijc,ijd->cd", one, rest) for one in every.values()])
    moved = picture.mean(axis=(0, 1))[taken] - rest.mean(axis=(0, 1))
    apart = np.vdot(picture, picture) + np.vdot(rest, rest) - 2.0 * products[:, taken, _OWN].sum(axis=2)
    near = apart / count - (moved**2).sum(axis=1) < limit**2  # (orientations, orders)
    return [
        (in_words(exchanged, words), one[..., channels])
        for k, (exchanged, channels) in enumerate(orders)
        for t, (words, one) in enumerate(every.items())
        if near[t, k] and (exchanged or words)
    ]


def _size(change: FloatArray) -> float:
    """Grey levels rms of a change, but for what all of it has in common."""
    count = change.size / 3
    mean = np.einsum("ijc->c", change) / count
    return float(np.sqrt(max(np.einsum("ijc,ijc->", change, change) / count - mean @ mean, 0.0)))
