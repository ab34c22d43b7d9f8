"""Rays of an imported look: sums that can be written down, samples that are spread as their weights."""

from typing import Any

import numpy as np
import pytest

from harness.basics.arrays import FloatArray
from harness.objectfile.published.answers import grey_levels
from harness.objectfile.published.entries import PublishedVisionEntry
from harness.objectfile.published.look import PublishedLook, views_of
from harness.objectfile.published.volume_render import further_depths, ray_weights
from harness.objectfile.vision.graph import sort_into_blocks

VIEW = views_of(np.array([[0.0, -2.5, 0.0, 0.0, 0.0, 1.0]]), 1.0, compat=False)[0]


LEAK = 384 * 1e-10
"""What the formula passes on, sample by sample, behind what hides everything."""


def entry(**other: Any) -> PublishedVisionEntry:
    """Of rays alone: no network is asked."""
    settings = {"near": 0.01, "far": 4.0, "samples": 384, "importance": 0, "white": True, "colour": "sigmoid"}
    return PublishedVisionEntry.model_construct(**{**settings, **other})


def picture_of(of: PublishedVisionEntry, raw: Any, size: int) -> FloatArray:
    return PublishedLook(of, raw).picture(VIEW, size, 0.5)


def slab(density: float, grey: float) -> Any:
    """Between two planes across the view, 0.5 apart."""

    def field(points: FloatArray, views: FloatArray, light: FloatArray) -> FloatArray:
        raw = np.zeros((len(points), 4))
        inside = np.abs(points[:, 1]) < 0.25
        raw[inside] = (grey, grey, grey, density)
        raw[~inside, 3] = -3.0
        return raw

    return field


def test_a_slab_covers_what_its_density_and_depth_say() -> None:
    for density in (0.1, 2.0, 30.0):
        found = picture_of(entry(), slab(density, 0.0), 3)
        cover = 2.0 * picture_of(entry(white=False), slab(density, 0.0), 3)[..., 0]
        along = np.linalg.norm(VIEW.directions(3, 0.5), axis=1).reshape(3, 3)
        samples = np.count_nonzero(np.abs(np.linspace(0.01, 4.0, 384) - 2.5) < 0.25)
        depth = samples * (3.99 / 383) * along
        assert cover == pytest.approx(1.0 - np.exp(-density * depth), abs=1e-6)
        grey = cover * 0.5 + (1.0 - cover)
        assert found == pytest.approx(np.repeat(grey[..., None], 3, axis=2), abs=1e-6)


@pytest.mark.parametrize("samples", [48, 384, 3072])
def test_the_sum_is_within_a_step_of_the_slabs_true_cover(samples: int) -> None:
    cover = 2.0 * picture_of(entry(samples=samples, white=False), slab(2.0, 0.0), 1)[0, 0, 0]
    step = 3.99 / (samples - 1)
    assert abs(float(cover) - (1.0 - np.exp(-2.0 * 0.5))) <= 2.0 * step


def test_nothing_is_white_and_black_where_the_background_is() -> None:
    for white, grey in ((True, 255), (False, 0)):
        found = picture_of(entry(white=white), slab(-1.0, 5.0), 2)
        assert (grey_levels(found, compat=False) == grey).all()
        assert (grey_levels(found, compat=True) == grey).all()


@pytest.mark.parametrize("raw", [-2000.0, -30.0, 0.0, 30.0, 2000.0])
def test_colours_of_any_size_are_finite_and_stretched(raw: float) -> None:
    with np.errstate(all="raise", under="ignore"):
        found = picture_of(entry(white=False), slab(1e4, raw), 1)
    assert np.isfinite(found).all()
    assert -0.1 - LEAK <= found.min() <= found.max() <= 1.1 + LEAK
    clipped = picture_of(entry(white=False, colour="clipped"), slab(1e4, raw), 1)
    assert clipped[0, 0, 0] == pytest.approx(1.2 * (np.clip(raw, 0, 1) - 0.5) + 0.5, abs=1e-6)


def test_truncated_greys_are_never_above_rounded_ones() -> None:
    found = picture_of(entry(), slab(2.0, 0.3), 5)
    exact, cut = 255.0 * found, grey_levels(found, compat=True)
    assert (np.abs(grey_levels(found, compat=False) - exact) <= 0.5).all()
    assert (cut <= exact).all()
    assert (cut > exact - 1.0).all()


def test_weights_are_shares_of_the_light() -> None:
    random = np.random.default_rng(0)
    depths = np.sort(random.random((50, 20)), axis=1)
    weights = ray_weights(random.normal(scale=20.0, size=(50, 20)), depths, random.normal(size=(50, 3)))
    assert (weights >= 0.0).all()
    assert (weights.sum(axis=1) <= 1.0 + LEAK).all()


def test_further_samples_lie_where_the_weights_are() -> None:
    edges = np.broadcast_to(np.linspace(1.0, 2.0, 11), (2, 11))
    weights = np.zeros((2, 10))
    weights[0] = 0.1
    weights[1, 3] = 1.0
    found = further_depths(edges, weights, 21)
    assert (np.diff(found, axis=1) >= -1e-12).all()
    assert found[0] == pytest.approx(np.linspace(1.0, 2.0, 21), abs=1e-9)
    assert np.count_nonzero((found[1] >= 1.3) & (found[1] <= 1.4)) >= 19
    assert found.min() >= 1.0
    assert found.max() <= 2.0


@pytest.mark.parametrize("size", [1, 3, 64])
def test_every_sample_is_in_one_block_of_its_own_network(size: int) -> None:
    networks = np.random.default_rng(0).integers(-1, 6, 100)
    samples, rows = sort_into_blocks(networks, 6, size)
    assert np.array_equal(np.unique(samples), np.flatnonzero(networks >= 0))
    assert (networks[samples] == rows[:, None]).all()
    assert [len(part) for part in sort_into_blocks(np.empty(0, np.int64), 6, size)] == [0, 0]
