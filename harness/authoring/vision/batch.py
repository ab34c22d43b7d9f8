"""What one step of a tiny network's training is shown, compiled: places and lamps.

Numbers are float32.
"""

from typing import Any, NamedTuple

import numpy as np

from harness.basics.arrays import AnyArray
from harness.basics.compiled import compiled_fast

_F = np.float32
_ONE, _TWO, _NONE = _F(1.0), _F(2.0), _F(0.0)

_EXTRAS = 4
"""Columns of ``told`` that are visibility and normal."""


class Lesson(NamedTuple):
    """What one network learns from; n places."""

    encoded: AnyArray  #: ``(n, 3 + 6 octaves)``.
    told: AnyArray
    """``(n, directions)`` what the later layer is told; ``(n, 0)`` where lamps are drawn anew."""
    normals: AnyArray  #: ``(n, 3)``.
    colours: AnyArray  #: ``(n, 3)`` linear; albedo where lamps are drawn anew.
    depth: AnyArray  #: ``(n,)`` of ``Lessons``.
    weight: AnyArray  #: ``(n,)`` of ``Lessons``.
    lamps: AnyArray  #: ``(m, 3)`` to draw from; none where each place has its own light.


class Batch(NamedTuple):
    """Room for a batch: inputs, what layers give, what their errors are."""

    at: AnyArray
    encoded: AnyArray
    told: AnyArray
    wanted: AnyArray
    lamps: AnyArray
    one: AnyArray
    two: AnyArray
    late: AnyArray
    mixed: AnyArray
    logits: AnyArray
    raw: AnyArray
    back: AnyArray


def batch_of(count: int, place: int, directions: int, width: int) -> Batch:
    """Room for ``count`` samples."""
    wide = [np.empty((count, size), _F) for size in (place, directions, 3, 3, width, width, width, width)]
    return Batch(np.empty(count, np.int64), *wide, *(np.empty((count, size), _F) for size in (3, 1, width)))


@compiled_fast
def _drawn(state: AnyArray) -> Any:
    """The next 64 bits (SplitMix64, Steele, Lea and Flood, OOPSLA 2014)."""
    state[0] += np.uint64(0x9E3779B97F4A7C15)
    z = state[0]
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


@compiled_fast
def encode(values: AnyArray, factors: AnyArray, first: int, out: AnyArray) -> None:
    """``vision_plain.encoded`` of ``(n, 3)`` into columns from ``first``, octave k times ``factors[k]``."""
    for n in range(len(values)):
        for axis in range(3):
            value = values[n, axis]
            out[n, first + axis] = value
            sine, cosine = np.sin(value), np.cos(value)
            for k in range(len(factors)):
                out[n, first + 3 + 6 * k + axis] = sine * factors[k]
                out[n, first + 6 + 6 * k + axis] = cosine * factors[k]
                twice = _TWO * sine
                sine, cosine = twice * cosine, _ONE - twice * sine


@compiled_fast
def gather(lesson: Lesson, state: AnyArray, batch: Batch) -> None:
    """Draw places, with the light that each has."""
    place, directions = lesson.encoded.shape[1], lesson.told.shape[1]
    for i in range(len(batch.at)):
        n = int(_drawn(state) % np.uint64(len(lesson.encoded)))
        batch.at[i] = n
        for j in range(place):
            batch.encoded[i, j] = lesson.encoded[n, j]
        for j in range(directions):
            batch.told[i, j] = lesson.told[n, j]
        if directions:
            for c in range(3):
                batch.wanted[i, c] = lesson.colours[n, c]


@compiled_fast
def light(lesson: Lesson, hidden: float, turns: AnyArray, state: AnyArray, batch: Batch) -> None:
    """Light the batch's places anew: by a lamp on their side, or by a hidden one from anywhere."""
    last = batch.told.shape[1] - _EXTRAS
    for i in range(len(batch.at)):
        n, bits = batch.at[i], _drawn(state)
        k = int(bits % np.uint64(len(lesson.lamps)))
        cosine = _NONE
        for c in range(3):
            cosine += lesson.lamps[k, c] * lesson.normals[n, c]
            batch.told[i, last + 1 + c] = lesson.normals[n, c]
        seen = (bits >> np.uint64(40)) >= np.uint64(hidden * 2**24)
        turned = -_ONE if seen and cosine < _NONE else _ONE
        batch.told[i, last] = _ONE if seen else _NONE
        for c in range(3):
            batch.lamps[i, c] = turned * lesson.lamps[k, c]
            batch.wanted[i, c] = lesson.colours[n, c] * turned * cosine if seen else _NONE
    encode(batch.lamps, turns, 0, batch.told)
