"""One tiny network's training, compiled: batches, layers forth and back, Adam (Kingma and Ba, 2015).

Cells know nothing of each other, so that a network and all it learns from stay in a core's second cache.
Numbers are float32. Colours are compared as roots of linear light, near to how a screen shows them.
"""

from typing import Any

import numpy as np

from harness.authoring.vision.batch import Batch, Lesson, gather, light
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

_ONE, _HALF, _NONE, _TINY = _F(1.0), _F(0.5), _F(0.0), _F(1e-9)

_GONE = _F(1e-36)
"""Moments below it are none: they move no weight, and a core takes a hundred times as long for numbers below
1.2e-38. A unit that ReLU has cut off would keep them for ever: 0.9 of the least number is again that."""

_WARM = 50
"""Steps over which the rate rises."""


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
