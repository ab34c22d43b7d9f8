"""Whether a picture has come to rest: a gel creeps after it is pressed, and after it is let go."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import FloatArray, block_means
from harness.bench.device import TactileCamera
from harness.bench.reading import Reading

_BLOCK = 8
"""Pixels: two grey levels of noise in each of them are half a level between two looks."""

_SHARE = 99.5
"""Percentile of the blocks that must be at rest: a contact fills a fiftieth of the picture."""


@dataclass(frozen=True)
class Stillness:
    """When a picture counts."""

    limit: float = 1.0  #: grey levels by which two looks may differ.
    looks: int = 2  #: looks in a row, each still against the one before, that make it settled.
    interval: float = 0.2  #: s between looks.
    patience: float = 5.0  #: s after which it is given up.
    frames: int = 3  #: a look is the mean of so many.
    timeout: float = 3.0  #: s that the camera may take for a look.


@dataclass(frozen=True, eq=False)
class Settling:
    """How a picture came to rest."""

    frames: Reading  #: the last look.
    unrest: FloatArray  #: ``(n,)`` grey levels between each look and the one before.
    settled: bool  #: whether it came to rest within the patience.
    seconds: float  #: from the first look to the last.


def settle(gel: TactileCamera, pause: Callable[[float], None], still: Stillness) -> Settling:
    """Look until the picture is at rest, or until patience ends.

    Args:
        gel: the camera.
        pause: waits so many seconds of the bench's own time.
        still: when it counts as at rest.

    Raises:
        BenchFault: the camera sends nothing.
    """
    frames = gel.read(still.frames, still.timeout)
    began, unrest, calm = float(frames.times[0]), [], 0
    while calm < still.looks and float(frames.times[-1]) - began < still.patience:
        pause(still.interval)
        later = gel.read(still.frames, still.timeout)
        unrest.append(unrest_between(look(frames), look(later)))
        calm = calm + 1 if unrest[-1] <= still.limit else 0
        frames = later
    return Settling(frames, np.array(unrest), calm >= still.looks, float(frames.times[-1]) - began)


def look(frames: Reading) -> FloatArray:
    """``(rows, columns, 3)`` grey levels, the mean of the frames."""
    mean: FloatArray = frames.values.astype(np.float64).mean(axis=0)
    return mean


def unrest_between(one: FloatArray, other: FloatArray) -> float:
    """Grey levels by which all but one in two hundred blocks of two looks agree."""
    return float(np.percentile(np.abs(block_means(other - one, _BLOCK)).max(axis=2), _SHARE))
