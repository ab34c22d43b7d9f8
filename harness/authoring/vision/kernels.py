"""Compiled training of one small network: batches of points and lights, layers, Adam (Kingma and Ba, 2015).

Cells are independent, so that a network and its training data stay in the L2 cache of a core.
Numbers are float32. Colours are compared as roots of linear light, near to how a screen shows them.
"""

from typing import Any, NamedTuple

import numpy as np

from harness.authoring.vision.layers import Layers
from harness.basics.arrays import AnyArray
from harness.basics.compiled import compiled_fast

_F = np.float32

_FAINT = np.float32(1e-3)
"""Linear light added under the root."""

_LEAST_SLOPE = np.float32(0.02)
"""Of a root to its logit: what is far too dark or too bright still learns."""

_MEAN, _SQUARE = np.float32(0.9), np.float32(0.99)
"""Adam's shares of what was before."""

_ONE, _TWO, _HALF, _NONE, _TINY = _F(1.0), _F(2.0), _F(0.5), _F(0.0), _F(1e-9)

_GONE = _F(1e-36)
"""Moments below it are none: they move no weight, and a core takes a hundred times as long for numbers below
1.2e-38. A unit that ReLU has cut off would keep them for ever: 0.9 of the least number is again that."""

_WARM = 50
"""Steps over which the rate rises."""


_EXTRAS = 4
"""Columns of ``told`` that are visibility and normal."""


class Lesson(NamedTuple):
    """Training samples of one network at n points."""

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


@compiled_fast
def _relu(values: AnyArray, bias: AnyArray) -> None:
    for i in range(values.shape[0]):
        for j in range(values.shape[1]):
            values[i, j] = max(values[i, j] + bias[j], _NONE)


@compiled_fast
def _forth(layers: Layers, encoded: AnyArray, told: AnyArray, batch: Batch) -> None:
    np.dot(encoded, layers.first, batch.one)
    _relu(batch.one, layers.first_bias)
    np.dot(batch.one, layers.second, batch.two)
    _relu(batch.two, layers.second_bias)
    np.dot(batch.two, layers.density, batch.raw)
    np.dot(batch.two, layers.mixed, batch.late)
    np.dot(told, layers.told, batch.mixed)
    for i in range(batch.late.shape[0]):
        for j in range(batch.late.shape[1]):
            batch.late[i, j] += batch.mixed[i, j]
    _relu(batch.late, layers.scatter_bias)
    np.dot(batch.late, layers.colour, batch.logits)


@compiled_fast
def _wrong(layers: Layers, lesson: Lesson, opacity: float, batch: Batch) -> float:
    """Put errors in place of what came out; the sum of squares of the colours' is returned."""
    share, loss, of_depth = _ONE / _F(len(batch.at)), 0.0, _F(opacity)
    for i in range(len(batch.at)):
        n = batch.at[i]
        weight = lesson.weight[n]
        for c in range(3):
            colour = _ONE / (_ONE + np.exp(-(batch.logits[i, c] + layers.colour_bias[c])))
            root = np.sqrt(colour + _FAINT)
            error = root - np.sqrt(batch.wanted[i, c] + _FAINT)
            slope = max(_HALF * colour * (_ONE - colour) / root, _LEAST_SLOPE)
            loss += weight * error * error
            batch.logits[i, c] = weight * share * error * slope
        depth = lesson.depth[n]
        error = batch.raw[i, 0] + layers.density_bias[0] - depth
        # Deeper than opaque and emptier than empty are no errors.
        done = (depth >= _ONE and error > _NONE) or (depth <= -_ONE and error < _NONE)
        batch.raw[i, 0] = _NONE if done else of_depth * share * error
    return loss


@compiled_fast
def _sums(values: AnyArray, out: AnyArray) -> None:
    out[:] = _NONE
    for i in range(values.shape[0]):
        for j in range(values.shape[1]):
            out[j] += values[i, j]


@compiled_fast
def _stop(errors: AnyArray, values: AnyArray) -> None:
    """No error goes back through what ReLU cut off."""
    for i in range(errors.shape[0]):
        for j in range(errors.shape[1]):
            if values[i, j] <= _NONE:
                errors[i, j] = _NONE


@compiled_fast
def _back(layers: Layers, slopes: Layers, batch: Batch) -> None:
    """Gradients, from the errors that ``_wrong`` left."""
    np.dot(batch.late.T, batch.logits, slopes.colour)
    _sums(batch.logits, slopes.colour_bias)
    np.dot(batch.logits, layers.colour.T, batch.back)
    _stop(batch.back, batch.late)
    np.dot(batch.two.T, batch.back, slopes.mixed)
    np.dot(batch.told.T, batch.back, slopes.told)
    _sums(batch.back, slopes.scatter_bias)
    np.dot(batch.back, layers.mixed.T, batch.mixed)
    np.dot(batch.two.T, batch.raw, slopes.density)
    _sums(batch.raw, slopes.density_bias)
    for i in range(batch.mixed.shape[0]):
        for j in range(batch.mixed.shape[1]):
            batch.mixed[i, j] += batch.raw[i, 0] * layers.density[j, 0]
    _stop(batch.mixed, batch.two)
    np.dot(batch.one.T, batch.mixed, slopes.second)
    _sums(batch.mixed, slopes.second_bias)
    np.dot(batch.mixed, layers.second.T, batch.back)
    _stop(batch.back, batch.one)
    np.dot(batch.encoded.T, batch.back, slopes.first)
    _sums(batch.back, slopes.first_bias)


@compiled_fast
def _adam(
    flat: AnyArray, slope: AnyArray, means: AnyArray, squares: AnyArray, rate: float, of: float
) -> None:
    """One step; ``rate`` and ``of`` have the corrections of first steps in them."""
    by, scale = _F(rate), _F(of)
    for p in range(len(flat)):
        mean = _MEAN * means[p] + (_ONE - _MEAN) * slope[p]
        square = _SQUARE * squares[p] + (_ONE - _SQUARE) * slope[p] * slope[p]
        means[p] = mean if abs(mean) > _GONE else _NONE
        squares[p] = square if square > _GONE else _NONE
        flat[p] -= by * means[p] / (np.sqrt(squares[p] * scale) + _TINY)


@compiled_fast
def teach(
    flat: AnyArray,
    layers: Layers,
    slope: AnyArray,
    slopes: Layers,
    lesson: Lesson,
    batch: Batch,
    turns: AnyArray,
    steps: int,
    rate: float,
    hidden: float,
    opacity: float,
    seed: int,
) -> float:
    """Train one network.

    Args:
        flat: ``(parameters,)`` float32, changed.
        layers: views into it.
        slope: ``(parameters,)`` float32, room.
        slopes: views into it.
        lesson: what it learns from.
        batch: room; as many samples a step as it has.
        turns: ``(turns,)`` float32 ones, octaves of directions.
        steps: of Adam.
        rate: of its first steps; it falls to zero as half a cosine.
        hidden: share of lamps that are hidden, where they are drawn anew.
        opacity: weight of the density's errors beside the colours'.
        seed: of the places and lamps drawn.

    Returns:
        Root mean square of the colours' errors, as roots of linear light, over the last tenth of the steps.
    """
    means, squares, state = np.zeros_like(flat), np.zeros_like(flat), np.array([seed], np.uint64)
    loss, counted, late = 0.0, 0, steps - steps // 10
    mean: Any = 1.0
    square: Any = 1.0
    for step in range(steps):
        gather(lesson, state, batch)
        if len(lesson.lamps):
            light(lesson, hidden, turns, state, batch)
        _forth(layers, batch.encoded, batch.told, batch)
        wrong = _wrong(layers, lesson, opacity, batch)
        _back(layers, slopes, batch)
        mean, square = mean * _MEAN, square * _SQUARE
        now = 0.5 * rate * (1.0 + np.cos(np.pi * step / steps)) * min(1.0, (step + 1) / _WARM)
        _adam(flat, slope, means, squares, now / (1.0 - mean), 1.0 / (1.0 - square))
        if step >= late:
            loss, counted = loss + wrong, counted + 3 * len(batch.at)
    return float(np.sqrt(loss / max(counted, 1)))
