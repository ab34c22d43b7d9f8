"""A tiny network's training, compiled: slopes, answers and moments are what plain arithmetic says."""

from dataclasses import replace

import numpy as np
import pytest

from harness.authoring.vision.kernels import Lesson, _adam, _back, _forth, _wrong, batch_of, encode
from harness.authoring.vision.layers import (
    first_weights,
    layer_shapes,
    layers_of,
    octave_factors,
    weights_of,
)
from harness.basics.arrays import AnyArray
from harness.objectfile.vision.network import VisionGrid, VisionModel
from harness.sim.light.direct_image import LitObject
from tests.oracles.plain_networks import Query, evaluate, local_places
from tests.samples.taught_ball import SIZE, lit_ball


@pytest.fixture(scope="module")
def lit() -> LitObject:
    return lit_ball()


def test_slopes_are_those_of_the_error(lit: LitObject) -> None:
    """Against differences of the loss, in the middle of the range, where no slope is raised."""
    random = np.random.default_rng(5)
    count, shapes = 64, layer_shapes(SIZE)
    flat = first_weights(SIZE, 1)
    layers_of(flat, SIZE).colour_bias[:] = 0.0
    slope = np.zeros_like(flat)
    batch = batch_of(count, SIZE.place, shapes.told[0], SIZE.width)
    lesson = Lesson(
        np.empty((count, SIZE.place), np.float32),
        np.empty((count, 0), np.float32),
        np.empty((count, 3), np.float32),
        np.empty((count, 3), np.float32),
        (0.9 * random.uniform(-1.0, 1.0, count)).astype(np.float32),
        random.random(count).astype(np.float32),
        np.empty((0, 3), np.float32),
    )
    batch.at[:] = np.arange(count)
    encode(random.uniform(-1, 1, (count, 3)).astype(np.float32), octave_factors(SIZE), 0, batch.encoded)
    batch.told[:] = random.standard_normal(batch.told.shape)
    batch.wanted[:] = random.random(batch.wanted.shape)
    opacity = 0.3

    def loss(at: AnyArray) -> float:
        layers = layers_of(at, SIZE)
        _forth(layers, batch.encoded, batch.told, batch)
        raw = batch.raw[:, 0].astype(np.float64) + layers.density_bias[0] - lesson.depth
        wrong = _wrong(layers, lesson, opacity, batch)
        return 0.5 * float(wrong + opacity * (raw**2).sum()) / count

    loss(flat)
    _back(layers_of(flat, SIZE), layers_of(slope, SIZE), batch)
    for ours, sloped in zip(layers_of(flat, SIZE), layers_of(slope, SIZE), strict=True):
        # Along all slopes at once nothing cancels; the step crosses next to no ReLU's bend.
        way = np.zeros_like(flat)
        begin = (ours.__array_interface__["data"][0] - flat.__array_interface__["data"][0]) // flat.itemsize
        way[begin : begin + ours.size] = np.sign(sloped).ravel()
        step = np.float32(2e-4)
        measured = (loss(flat + step * way) - loss(flat - step * way)) / (2.0 * float(step))
        assert measured == pytest.approx(float(np.abs(sloped).sum()), rel=0.02)


def test_what_is_written_answers_as_what_was_trained() -> None:
    random, size = np.random.default_rng(2), replace(SIZE, octaves=6)
    flats = np.stack([first_weights(size, seed) for seed in (1, 2)])
    flats = flats.astype(np.float16).astype(np.float32)
    grid = VisionGrid(np.zeros(3), 2.0, np.array([[0, 0, 0], [1, 0, 0]]))
    points = random.random((40, 3)) * (4.0, 2.0, 2.0)
    networks = grid.networks(points)
    light = np.array([0.6, 0.0, 0.8])
    extras = random.random((40, 4))
    model = VisionModel(grid, weights_of(flats, size, 7.0))
    density, colour = evaluate(model, Query(networks, points, np.tile(light, (40, 1)), light, extras))
    for cell in (0, 1):
        at = np.flatnonzero(networks == cell)
        batch = batch_of(len(at), size.place, layer_shapes(size).told[0], size.width)
        local = local_places(grid, points[at], networks[at]).astype(np.float32)
        encode(local, octave_factors(size), 0, batch.encoded)
        encode(np.tile(light, (len(at), 1)).astype(np.float32), np.ones(2, np.float32), 0, batch.told)
        batch.told[:, -4:] = extras[at]
        layers = layers_of(flats[cell], size)
        _forth(layers, batch.encoded, batch.told, batch)
        raw = batch.raw[:, 0] + layers.density_bias
        assert density[at] == pytest.approx(7.0 * np.maximum(raw, 0.0), abs=7.0 * 1e-2)
        assert colour[at] == pytest.approx(1 / (1 + np.exp(-batch.logits - layers.colour_bias)), abs=2e-3)


def test_moments_of_what_learns_no_more_end_at_zero_and_not_below_what_numbers_can_be() -> None:
    """Against Adam in float64: weights whose slopes stop go on as there, and their moments vanish."""
    random, steps = np.random.default_rng(5), 12_000
    slopes = random.normal(size=(40, 64)) * 10.0 ** random.uniform(-12, 0, 64)
    flat, means, squares = (np.zeros(64, np.float32) for _ in range(3))
    weights, mean, square = np.zeros((3, 64))
    least = np.finfo(np.float32).tiny
    for step in range(steps):
        slope = slopes[step] if step < len(slopes) else np.zeros(64)
        _adam(flat, slope.astype(np.float32), means, squares, 1e-3, 1.0)
        mean, square = 0.9 * mean + 0.1 * slope, 0.99 * square + 0.01 * slope**2
        weights -= 1e-3 * mean / (np.sqrt(square) + 1e-9)
        for moment in (means, squares):
            assert not np.any((moment != 0.0) & (np.abs(moment) < least))
    assert not means.any()
    assert not squares.any()
    assert flat == pytest.approx(weights, rel=1e-4, abs=1e-7)
