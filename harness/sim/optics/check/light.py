"""The light of a tactile picture against a reference picture of the same gel: gains, offsets, orientation."""

from dataclasses import dataclass
from itertools import permutations

import numpy as np

from harness.basics.arrays import FloatArray, IntArray

ALIKE = 12.0
"""Grey levels within which a block is explained by the light alone; a contact changes more."""

UNCHANGED = 4.0
"""Grey levels within which a block is the reference's, or its light's."""

_LEAST_UNCHANGED, _LEAST_TIGHT = 0.25, 0.4
"""Shares of the blocks: as much of a gel as is at rest in view."""

_TURNS = 6
_LEAST_STRUCTURE = 4.0
"""Grey levels of standard deviation from which a resting picture tells a gain from an offset."""

_LEAST_BLOCKS = 20
_CHANNELS = ("red", "green", "blue")
_SAME = "as calibrated"


@dataclass(frozen=True, eq=False)
class LightMatch:
    """``seen = gain * known + offset`` per channel.

    Attributes:
        gain: ``(3,)``, 1 where the light is the same.
        offset: ``(3,)`` grey levels.
        alike: share of the blocks within ``ALIKE`` of that.
        tight: share of the blocks within ``UNCHANGED`` of it.
        sure: whether enough of the picture follows it closely for a correction.
    """

    gain: FloatArray
    offset: FloatArray
    alike: float
    tight: float
    sure: bool

    def shown(self, known: FloatArray) -> FloatArray:
        """The known picture in this light."""
        return np.asarray(self.gain * known + self.offset)


def fit_light(seen: FloatArray, known: FloatArray) -> LightMatch:
    """The light of a picture: unchanged where a quarter of it is as the reference, else fitted.

    Args:
        seen: ``(rows, columns, 3)`` grey levels, means over blocks.
        known: the same, of the reference.
    """
    change = np.abs(seen - known).max(axis=2)
    unchanged = float((change < UNCHANGED).mean())
    if unchanged >= _LEAST_UNCHANGED:
        alike = float((change < ALIKE).mean())
        return LightMatch(np.ones(3), np.zeros(3), alike, unchanged, True)
    return _fitted(seen.reshape(-1, 3), known.reshape(-1, 3))


def _fitted(y: FloatArray, x: FloatArray) -> LightMatch:
    near = np.ones(len(x), np.bool_)
    gain, offset, apart = np.ones(3), np.zeros(3), np.zeros(len(x))
    for _ in range(_TURNS):
        gain, offset = _line(x[near], y[near])
        apart = np.abs(y - gain * x - offset).max(axis=1)
        near = apart <= max(0.5 * ALIKE, 1.5 * float(np.median(apart)))
        if near.sum() < _LEAST_BLOCKS:
            break
    tight = float((apart < UNCHANGED).mean())
    return LightMatch(gain, offset, float((apart < ALIKE).mean()), tight, tight >= _LEAST_TIGHT)


def _line(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Gain and offset of each channel; the ratio of the means where the reference has no structure."""
    middle, level = x.mean(axis=0), y.mean(axis=0)
    spread = ((x - middle) ** 2).mean(axis=0)
    structured = spread > _LEAST_STRUCTURE**2
    slope = ((x - middle) * (y - level)).mean(axis=0) / np.maximum(spread, 1e-9)
    gain = np.where(structured, slope, level / np.maximum(middle, 1.0))
    return gain, level - gain * middle


def orientation(seen: FloatArray, known: FloatArray) -> tuple[str, LightMatch]:
    """Channel order and orientation of the reference that explain a picture best, and its light in it.

    Args:
        seen: ``(rows, columns, 3)`` grey levels, means over blocks.
        known: the same, of the reference.

    Returns:
        In words, ``as calibrated`` for the reference as it is.
    """
    found = [(words, fit_light(seen[::2, ::2], other[::2, ::2])) for words, other in variants(known)]
    return max(found, key=lambda one: one[1].alike if (one[1].gain > 0.2).all() else 0.0)


def same(words: str) -> bool:
    """Whether an orientation is the calibration's own."""
    return words == _SAME


def variants(picture: FloatArray, back: bool = False) -> list[tuple[str, FloatArray]]:
    """A picture in every order of channels and orientation, in words; ``as calibrated`` for itself, first.

    Args:
        picture: ``(rows, columns, 3)``.
        back: whether the picture is taken to be in each of them, and brought back.
    """
    every = turns(picture, back)
    return [
        (both_in_words(exchanged, words), one[..., taken])
        for exchanged, taken in channel_orders(back)
        for words, one in every.items()
    ]


def turns(picture: FloatArray, back: bool = False) -> dict[str, FloatArray]:
    """A picture in every orientation, by its words, as ``variants`` has them; empty for itself, first."""
    quarter = -1 if back else 1
    turned = {
        "": picture,
        "mirrored left to right": picture[:, ::-1],
        "upside down": picture[::-1],
        "turned by 180 degrees": picture[::-1, ::-1],
    }
    if picture.shape[0] == picture.shape[1]:
        turned["turned by 90 degrees"] = np.rot90(picture, quarter)
        turned["turned by 270 degrees"] = np.rot90(picture, 3 * quarter)
    return turned


def channel_orders(back: bool = False) -> list[tuple[str, IntArray]]:
    """Every order of channels, in words, and ``(3,)`` the channels to take for it; the given one first."""
    return [
        (
            "" if order == (0, 1, 2) else f"channels {', '.join(_CHANNELS[k] for k in order)}",
            np.argsort(order) if back else np.array(order),
        )
        for order in permutations(range(3))
    ]


def both_in_words(exchanged: str, turned: str) -> str:
    """Words for an order of channels and an orientation together; ``as calibrated`` for neither."""
    return ", ".join(part for part in (exchanged, turned) if part) or _SAME
