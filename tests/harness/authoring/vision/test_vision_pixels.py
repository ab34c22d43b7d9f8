"""What pixels say of samples adds up to the pixels, and says nothing of what it cannot know."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.authoring.vision.pixels import pixel_lessons, shares_along
from harness.authoring.vision.seen import SeenRays
from harness.basics.arrays import AnyArray

SCALE = 400.0
"""1/m."""


def rays_of(seed: int, thick: float, count: int = 30, most: int = 6) -> SeenRays:
    """Of some samples each, all about as thick, and pixels near to what they show."""
    random = np.random.default_rng(seed)
    every = random.integers(1, most, count)
    total = int(every.sum())
    way = random.standard_normal((2, count, 3))
    way /= np.linalg.norm(way, axis=2, keepdims=True)
    density = (thick * random.uniform(0.8, 1.2, total)).astype(np.float32)
    return SeenRays(
        points=random.standard_normal((total, 3)),
        lengths=np.full(total, 1.0 / SCALE, np.float32),
        first=np.concatenate([[0], np.cumsum(every)]),
        views=way[0].astype(np.float32),
        lights=way[1].astype(np.float32),
        extras=np.hstack([np.ones((count, 1)), way[0]]).astype(np.float32),
        wanted=random.uniform(0.25, 0.35, (count, 3)).astype(np.float32),
        weight=random.uniform(0.1, 1.0, count).astype(np.float32),
        density=density,
        scattered=random.uniform(0.4, 0.5, (total, 3)).astype(np.float32),
    )


def walked(rays: SeenRays) -> AnyArray:
    """Shares of light, plainly."""
    found = []
    for ray in range(len(rays)):
        left = 1.0
        for s in range(rays.first[ray], rays.first[ray + 1]):
            passed = np.exp(-SCALE * float(rays.density[s]) * float(rays.lengths[s]))
            found.append(left * (1.0 - passed))
            left *= passed
    return np.array(found)


@given(seed=st.integers(0, 1000), thick=st.sampled_from([0.0, 1e-6, 0.3, 3.0, 1e4]))
def test_shares_of_light_are_those_of_a_plain_walk(seed: int, thick: float) -> None:
    rays = rays_of(seed, thick)
    found = shares_along(SCALE * rays.density.astype(np.float64) * rays.lengths, rays.first)
    # Sums over all rays at once lose 1e-16 of their whole, 1e6 at most.
    assert found == pytest.approx(walked(rays), abs=1e-9, rel=1e-6)


@given(seed=st.integers(0, 1000))
def test_samples_with_their_lessons_colours_are_the_pixels(seed: int) -> None:
    rays = rays_of(seed, 0.9, most=3)
    shares, lessons = walked(rays), pixel_lessons(rays, SCALE)
    stopped = np.add.reduceat(shares, rays.first[:-1])
    assert len(lessons) == np.diff(rays.first)[stopped >= 0.5].sum() > 0
    begin = 0
    for ray in np.flatnonzero(stopped >= 0.5):
        own = slice(rays.first[ray], rays.first[ray + 1])
        part = slice(begin, begin := begin + own.stop - own.start)
        assert np.array_equal(lessons.points[part], rays.points[own])
        assert shares[own] @ lessons.colours[part] == pytest.approx(rays.wanted[ray], abs=1e-6)
        assert (lessons.lamps[part] == rays.lights[ray]).all()
        assert (lessons.views[part] == rays.views[ray]).all()
        assert np.array_equal(lessons.seen[part], np.tile(rays.extras[ray, :1], (own.stop - own.start, 1)))


def test_heavier_are_samples_that_show_more_of_a_pixel() -> None:
    rays = rays_of(1, 1.5)
    lessons, shares = pixel_lessons(rays, SCALE), walked(rays)
    stopped = np.repeat(np.add.reduceat(shares, rays.first[:-1]), np.diff(rays.first))
    kept = (stopped >= 0.5) & (shares >= 0.05)
    wanted = (shares * np.repeat(rays.weight, np.diff(rays.first)))[kept]
    assert lessons.weight.mean() == pytest.approx(1.0, rel=1e-5)
    assert lessons.weight / lessons.weight[0] == pytest.approx(wanted / wanted[0], rel=1e-5)


def test_colours_stay_what_a_surface_can_have() -> None:
    rays = rays_of(2, 3.0)
    for wanted in (-5.0, 5.0):
        rays.wanted[:] = wanted
        colours = pixel_lessons(rays, SCALE).colours
        assert np.isin(colours, (0.0, 1.0)).all()


def test_of_rays_that_pass_by_nothing_is_learned() -> None:
    for thick in (0.0, 1e-3):
        lessons = pixel_lessons(rays_of(3, thick), SCALE)
        assert len(lessons) == 0
        assert lessons.colours.shape == (0, 3)
