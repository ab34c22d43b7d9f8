"""What a weighted cloud of places says: known clouds, and what must not depend on how they are written."""

from itertools import pairwise

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from experiments.contact_localization.posterior.posterior import (
    best_point,
    credible_radius,
    credible_region,
    modes,
    thinned,
)
from harness.basics.arrays import FloatArray
from harness.basics.geometry import apply, rotation_from_vector, transform
from harness.sim.solid.surface_samples import Surface, sample_surface
from tests.samples.synthetic_press import box, solid

FLOOR = 1.3e-3
POSE = transform(rotation_from_vector(np.array([0.6, -1.2, 0.3])), np.array([0.3, -0.2, 0.5]))
LEFT, RIGHT = np.array([-0.03, 0.0, 0.0]), np.array([0.03, 0.01, 0.0])


@pytest.fixture(scope="module")
def slab() -> Surface:
    """The top of it, 100 x 100 mm, is a plane to anything within it."""
    return sample_surface(box(0.1, 0.1, 0.02), 1.5e-3)


def on_top(sigma: float, count: int, seed: int = 1, centre: tuple[float, float] = (0.0, 0.0)) -> FloatArray:
    """A Gaussian cloud on the slab's top."""
    places = np.random.default_rng(seed).normal(size=(count, 2)) * sigma + centre
    return np.column_stack([places, np.full(count, 0.01)])


def equal(count: int) -> FloatArray:
    return np.full(count, 1.0 / count)


def bumps(heavy: float, count: int = 300, seed: int = 0) -> tuple[FloatArray, FloatArray]:
    """Two clouds of 1 mm; the left one holds ``heavy``."""
    rng = np.random.default_rng(seed)
    cloud = rng.normal(size=(count, 3)) * 1e-3
    left = np.arange(count) % 2 == 0
    cloud += np.where(left[:, None], LEFT, RIGHT)
    weights = np.where(left, heavy / left.sum(), (1.0 - heavy) / (~left).sum())
    return cloud, weights


@pytest.mark.parametrize("sigma", [2e-3, 5e-3])
@pytest.mark.parametrize("share", [0.5, 0.9])
def test_a_region_has_the_area_of_the_known_gaussian(slab: Surface, sigma: float, share: float) -> None:
    """A Gaussian widened by the floor holds its share within pi r^2, r^2 = -2 ln(1 - share) (s^2 + f^2)."""
    points = on_top(sigma, 4000)
    region = credible_region(points, equal(len(points)), slab, FLOOR, share)
    expected = -2.0 * np.pi * np.log(1.0 - share) * (sigma**2 + FLOOR**2)
    # 400 points stand for the cloud, and at 1.3 mm they are bumpy for a wide one.
    assert region.area == pytest.approx(expected, rel=0.15)


@pytest.mark.parametrize("sigma", [0.5e-3, 2e-3, 5e-3])
def test_a_region_holds_the_share_asked_for(slab: Surface, sigma: float) -> None:
    """The truth differs from the cloud's places by the floor: 90 % of such truths lie inside."""
    points = on_top(sigma, 4000)
    region = credible_region(points, equal(len(points)), slab, FLOOR)
    truths = on_top(np.hypot(sigma, FLOOR), 1500, seed=2)
    held = np.mean([region.contains(truth) for truth in truths])
    # Places between samples belong to the nearest, half a spacing generous: more for a small region.
    edge = 0.5 * slab.spacing / (2.15 * np.hypot(sigma, FLOOR))
    assert 0.88 <= held <= 0.92 + 0.46 * edge


def test_a_region_grows_with_its_share_and_its_floor(slab: Surface) -> None:
    points = on_top(3e-3, 300)
    shares = [credible_region(points, equal(300), slab, FLOOR, share) for share in (0.3, 0.6, 0.9)]
    for smaller, larger in pairwise(shares):
        assert smaller.area < larger.area
        assert not np.any(smaller.inside & ~larger.inside)
    floors = [credible_region(points, equal(300), slab, floor).area for floor in (1e-3, 2e-3, 4e-3)]
    assert floors == sorted(floors)


def test_a_region_keeps_to_the_faces_that_the_cloud_lies_on() -> None:
    """Between two clouds there is no surface that belongs."""
    surface = sample_surface(box(0.1, 0.1, 0.02), 2e-3)
    points = np.vstack([on_top(1e-3, 150, centre=(-0.03, 0.0)), on_top(1e-3, 150, centre=(0.03, 0.0))])
    region = credible_region(points, equal(300), surface, FLOOR)
    assert np.all(np.abs(np.abs(region.points[:, 0]) - 0.03) < 0.01)
    assert region.contains(np.array([-0.03, 0.0, 0.01]))
    assert not region.contains(np.array([0.0, 0.0, 0.01]))


def test_a_region_of_one_certain_place_is_the_floors_own() -> None:
    surface = sample_surface(solid(trimesh.creation.icosphere(subdivisions=3, radius=0.03)), 1.5e-3)
    place = surface.points[17]
    region = credible_region(place[None], np.ones(1), surface, FLOOR)
    assert region.contains(place)
    assert np.linalg.norm(region.points - place, axis=1).max() < 2.15 * FLOOR + 2.0 * surface.spacing


def test_a_place_farther_from_every_sample_than_the_floor_reaches_still_counts(slab: Surface) -> None:
    region = credible_region(np.array([[0.0, 0.0, 0.05]]), np.ones(1), slab, FLOOR)
    assert region.inside.sum() >= 1
    assert region.contains(np.array([0.0, 0.0, 0.01]))


@pytest.mark.parametrize("sigma", [1e-3, 4e-3])
def test_the_radius_of_a_known_gaussian(sigma: float) -> None:
    """90 % of a Gaussian on a surface lie within 2.15 sigma (Rayleigh); the floor adds in quadrature."""
    points = on_top(sigma, 20_000)
    radius = credible_radius(points, equal(len(points)), np.array([0.0, 0.0, 0.01]), FLOOR)
    assert radius == pytest.approx(2.146 * np.hypot(sigma, FLOOR), rel=0.03)


def test_a_certain_place_has_the_floors_radius() -> None:
    point = np.array([[0.01, 0.02, 0.03]])
    assert credible_radius(point, np.ones(1), point[0], FLOOR) == pytest.approx(2.146 * FLOOR, rel=1e-3)


@pytest.mark.parametrize("heavy", [0.55, 0.7, 0.9])
def test_two_bumps_are_two_modes_with_their_places_shares_and_spreads(heavy: float) -> None:
    found = modes(*bumps(heavy))
    assert [mode.weight for mode in found] == pytest.approx([heavy, 1.0 - heavy], abs=0.01)
    assert np.linalg.norm(found[0].position - LEFT) < 0.4e-3
    assert np.linalg.norm(found[1].position - RIGHT) < 0.4e-3
    for mode in found:
        assert np.sqrt(np.diag(mode.covariance)) == pytest.approx(1e-3, rel=0.2)


def test_a_bump_of_less_than_a_twentieth_is_no_mode() -> None:
    assert len(modes(*bumps(0.97))) == 1
    assert len(modes(*bumps(0.93))) == 2


def test_the_modes_never_hold_more_than_everything() -> None:
    rng = np.random.default_rng(3)
    wide = rng.uniform(-0.05, 0.05, (350, 3))
    found = modes(wide, equal(350))
    assert sum(mode.weight for mode in found) <= 1.0 + 1e-12
    weights = [mode.weight for mode in found]
    assert weights == sorted(weights, reverse=True)


@given(heavy=st.floats(0.52, 0.98), seed=st.integers(0, 50))
@settings(max_examples=40, deadline=None)
def test_the_best_point_stays_in_the_heaviest_mode(heavy: float, seed: int) -> None:
    best = best_point(*bumps(heavy, seed=seed))
    assert np.linalg.norm(best - LEFT) < 0.5e-3


def test_the_best_point_of_one_cloud_is_its_mean() -> None:
    points = on_top(0.8e-3, 2000)
    assert best_point(points, equal(2000)) == pytest.approx(points.mean(axis=0), abs=0.02e-3)


def test_the_best_point_of_one_place_is_that_place() -> None:
    assert best_point(LEFT[None], np.ones(1)) == pytest.approx(LEFT, abs=1e-12)


def test_weights_and_not_numbers_of_points_decide() -> None:
    """A place said ten times with a tenth of the weight is the same place."""
    points, weights = bumps(0.6, count=100)
    right = np.arange(100) % 2 == 1
    more = np.vstack([points[~right], np.repeat(points[right], 5, axis=0)])
    shared = np.r_[weights[~right], np.repeat(weights[right] / 5.0, 5)]
    assert best_point(more, shared) == pytest.approx(best_point(points, weights), abs=1e-9)
    assert [m.weight for m in modes(more, shared)] == pytest.approx(
        [m.weight for m in modes(points, weights)]
    )


@pytest.mark.parametrize("count", [300, 2000])
def test_the_order_of_the_points_does_not_matter(slab: Surface, count: int) -> None:
    points, weights = bumps(0.7, count=count)
    order = np.random.default_rng(5).permutation(count)
    # Of more than 400 points 400 are drawn: three sigma of a share of 0.7 are 0.07.
    close, share = (1e-12, 1e-12) if count <= 400 else (0.05e-3, 0.07)
    assert best_point(points[order], weights[order]) == pytest.approx(best_point(points, weights), abs=close)
    here, there = modes(points, weights), modes(points[order], weights[order])
    assert [m.weight for m in there] == pytest.approx([m.weight for m in here], abs=share)
    cloud, even = on_top(3e-3, count), equal(count)
    area = credible_region(cloud, even, slab, FLOOR).area
    assert credible_region(cloud[order], even, slab, FLOOR).area == pytest.approx(area, rel=0.1)


def test_scaling_all_weights_changes_nothing() -> None:
    points, weights = bumps(0.7)
    assert best_point(points, 7.0 * weights) == pytest.approx(best_point(points, weights), abs=1e-12)
    assert [m.weight for m in modes(points, 7.0 * weights)] == pytest.approx(
        [m.weight for m in modes(points, weights)]
    )
    at = credible_radius(points, weights, LEFT, FLOOR)
    assert credible_radius(points, 7.0 * weights, LEFT, FLOOR) == pytest.approx(at)


def test_moving_everything_moves_the_answer_along() -> None:
    points, weights = bumps(0.7)
    moved = apply(POSE, points)
    best = best_point(points, weights)
    assert best_point(moved, weights) == pytest.approx(apply(POSE, best[None])[0], abs=1e-12)
    here, there = modes(points, weights), modes(moved, weights)
    assert [m.weight for m in there] == pytest.approx([m.weight for m in here])
    for a, b in zip(here, there, strict=True):
        assert b.position == pytest.approx(apply(POSE, a.position[None])[0], abs=1e-12)
        turned = POSE[:3, :3] @ a.covariance @ POSE[:3, :3].T
        assert b.covariance == pytest.approx(turned, abs=1e-12)
    radius = credible_radius(points, weights, best, FLOOR)
    there_radius = credible_radius(moved, weights, apply(POSE, best[None])[0], FLOOR)
    assert there_radius == pytest.approx(radius, abs=1e-12)


def test_moving_surface_and_cloud_moves_the_region_along(slab: Surface) -> None:
    points = on_top(2e-3, 200)
    here = credible_region(points, equal(200), slab, FLOOR)
    surface = Surface(
        slab.spacing,
        apply(POSE, slab.points),
        slab.normals @ POSE[:3, :3].T,
        slab.areas,
        slab.neighbours,
        slab.table,
    )
    there = credible_region(apply(POSE, points), equal(200), surface, FLOOR)
    assert there.area == pytest.approx(here.area)
    np.testing.assert_array_equal(there.inside, here.inside)


@pytest.mark.parametrize("count", [401, 800, 1000, 2000, 3000, 4400])
def test_thinning_keeps_the_shares_whatever_the_rhythm_of_the_points(count: int) -> None:
    """The two bumps' points take turns, as the yaws of a grid do."""
    few, shares = thinned(*bumps(0.7, count=count))
    assert len(few) <= 400
    assert shares.sum() == pytest.approx(1.0)
    assert shares[few[:, 0] < 0.0].sum() == pytest.approx(0.7, abs=0.02)
