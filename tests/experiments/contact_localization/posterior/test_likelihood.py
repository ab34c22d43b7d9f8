"""How places and tool axes weigh hypotheses: against a plain reference, capped, and blind to the bench."""

import numpy as np
import pytest
import trimesh

from experiments.contact_localization.posterior.likelihood import (
    Arrangement,
    GeometryNoise,
    arrange,
    geometry_scores,
    possible_anchors,
)
from harness.basics.arrays import FloatArray, IntArray
from harness.basics.geometry import rotation_about
from harness.sim.solid.surface_samples import Surface, sample_surface
from tests.samples.synthetic_press import solid, stepped_block

NOISE = GeometryNoise()
UP = np.array([0.0, 0.0, 1.0])
RADIUS = 0.025


@pytest.fixture(scope="module")
def block() -> Surface:
    return sample_surface(stepped_block(), 3e-3)


@pytest.fixture(scope="module")
def ball() -> Surface:
    return sample_surface(solid(trimesh.creation.icosphere(subdivisions=5, radius=RADIUS)), 2e-3)


def turns(*degrees: float) -> FloatArray:
    return np.array([rotation_about(UP, np.radians(d)).T for d in degrees])


def touched(surface: Surface, count: int, seed: int, tilt: float = 0.1) -> tuple[FloatArray, FloatArray]:
    """Places of some samples and tools tilted by up to ``tilt`` rad from their normals."""
    rng = np.random.default_rng(seed)
    chosen = rng.choice(len(surface.points), count, replace=False)
    axes = -surface.normals[chosen] + tilt * rng.uniform(-1.0, 1.0, (count, 3)) / np.sqrt(3.0)
    return surface.points[chosen], axes / np.linalg.norm(axes, axis=1)[:, None]


def pairs(surface: Surface, arrangement: Arrangement, use_axis: bool = True) -> tuple[IntArray, IntArray]:
    return possible_anchors(surface, arrangement, NOISE, use_axis)


def scores(
    surface: Surface,
    arrangement: Arrangement,
    samples: IntArray,
    yaws: IntArray,
    use_axis: bool = True,
    within: float = np.inf,
    noise: GeometryNoise = NOISE,
) -> FloatArray:
    prior = np.log(surface.areas[samples])
    return geometry_scores(surface, arrangement, samples, yaws, prior, noise, use_axis, within)


def reference(
    surface: Surface, arrangement: Arrangement, sample: int, yaw: int, use_axis: bool, noise: GeometryNoise
) -> float:
    """One hypothesis, written out: no table of costs, no early end."""
    total = float(np.log(surface.areas[sample]))
    sigmas = arrangement.gap_sigmas(noise)
    for k, (offset, axis) in enumerate(zip(arrangement.offsets[yaw], arrangement.axes[yaw], strict=True)):
        place = surface.points[sample] + offset
        candidates = [sample] if k == arrangement.anchor else nearby(surface, place, use_axis)
        fits = [fit(surface, i, place, axis, float(sigmas[k]), use_axis, noise) for i in candidates]
        total += max([*fits, -noise.cap])
    return total


def nearby(surface: Surface, place: FloatArray, use_axis: bool) -> list[int]:
    voxel = np.floor((place - surface.table.origin) / surface.table.pitch).astype(np.int64)
    if (voxel < 0).any() or (voxel >= surface.table.nearest.shape).any():
        return []
    nearest = int(surface.table.nearest[tuple(voxel)])
    if nearest < 0:
        return []
    return [nearest, *surface.neighbours[nearest].tolist()] if use_axis else [nearest]


def fit(
    surface: Surface,
    sample: int,
    place: FloatArray,
    axis: FloatArray,
    sigma: float,
    use_axis: bool,
    noise: GeometryNoise,
) -> float:
    gap, normal = place - surface.points[sample], surface.normals[sample]
    out = float(gap @ normal)
    along = max(0.0, float(np.linalg.norm(gap - out * normal)) - surface.spacing)
    cost = (out**2 + along**2) / sigma**2
    if use_axis:
        angle = float(np.arccos(np.clip(-normal @ axis, -1.0, 1.0)))
        cost += (max(0.0, angle - noise.free_angle) / noise.angle) ** 2
    return -0.5 * cost


@pytest.mark.parametrize("use_axis", [True, False])
def test_scores_are_those_of_the_plain_reference(block: Surface, use_axis: bool) -> None:
    points, axes = touched(block, 5, seed=3)
    arrangement = arrange(turns(-4.0, 0.0, 7.0), points, axes, anchor=1)
    samples, yaws = pairs(block, arrangement, use_axis)
    some = np.random.default_rng(0).choice(len(samples), 150, replace=False)
    found = scores(block, arrangement, samples[some], yaws[some], use_axis)
    expected = [
        reference(block, arrangement, int(i), int(j), use_axis, NOISE)
        for i, j in zip(samples[some], yaws[some], strict=True)
    ]
    # Neighbours are looked at only where the nearest sample costs more than half a nat.
    slack = 0.5 * 4 if use_axis else 1e-9
    assert np.all(found <= np.array(expected) + 1e-9)
    assert np.all(found >= np.array(expected) - slack)


def test_the_true_place_of_exact_contacts_costs_nothing(block: Surface) -> None:
    points, axes = touched(block, 6, seed=5, tilt=0.0)
    arrangement = arrange(turns(0.0), points, axes, anchor=0)
    true = np.array([int(block.tree.query(points[0])[1])])
    cost = scores(block, arrangement, true, np.zeros(1, np.int64)) - np.log(block.areas[true])
    # The table answers for a voxel with the sample nearest to its centre: flat faces forgive it.
    assert cost[0] > -0.5


def test_a_contact_beside_a_ball_costs_the_square_of_its_distance(ball: Surface) -> None:
    """On a smooth closed surface the exact term is known: minus half of (distance / sigma) squared."""
    anchor = int(np.argmax(ball.points[:, 2]))
    top = ball.points[anchor]
    for beside in (-1.5e-3, -0.5e-3, 0.0, 1e-3, 2e-3):
        side = np.array([RADIUS + beside, 0.0, 0.0])
        arrangement = arrange(turns(0.0), np.array([top, side]), np.array([-UP, [-1.0, 0.0, 0.0]]), 0)
        sigma = arrangement.gap_sigmas(NOISE)[1]
        found = scores(ball, arrangement, np.array([anchor]), np.zeros(1, np.int64), use_axis=False)
        found -= np.log(ball.areas[anchor])
        # A sample's plane leaves the ball by spacing^2 / 2R within the spacing.
        sag = ball.spacing**2 / (2.0 * RADIUS)
        least = max(0.0, abs(beside) - sag)
        assert -0.5 * ((abs(beside) + sag) / sigma) ** 2 <= found[0] <= -0.5 * (least / sigma) ** 2


def test_a_tool_within_the_free_angle_costs_nothing_and_beyond_it_the_square(ball: Surface) -> None:
    anchor = int(np.argmax(ball.points[:, 2]))
    normal = ball.normals[anchor]
    across = np.cross(normal, [1.0, 0.0, 0.0])
    across /= np.linalg.norm(across)
    for angle in np.radians([0.0, 10.0, 15.9, 18.0, 20.0]):
        axis = rotation_about(across, angle) @ -normal
        arrangement = arrange(turns(0.0), ball.points[anchor][None], axis[None], 0)
        found = scores(ball, arrangement, np.array([anchor]), np.zeros(1, np.int64))
        beyond = max(0.0, angle - NOISE.free_angle) / NOISE.angle
        assert found[0] - np.log(ball.areas[anchor]) == pytest.approx(-0.5 * beyond**2, abs=1e-9)


@pytest.mark.parametrize("far", [0.03, 3.0])
def test_one_contact_costs_no_more_than_the_cap(block: Surface, far: float) -> None:
    """Wherever it slipped to, and whether the table reaches there or not."""
    points, axes = touched(block, 5, seed=3)
    whole = arrange(turns(0.0), points, axes, anchor=1)
    samples, yaws = pairs(block, whole)
    before = scores(block, whole, samples, yaws)
    slipped = points.copy()
    slipped[4] += far
    after = scores(block, arrange(turns(0.0), slipped, axes, anchor=1), samples, yaws)
    assert np.all(after >= before - NOISE.cap - 1e-9)
    without = scores(block, arrange(turns(0.0), points[:4], axes[:4], anchor=1), samples, yaws)
    assert after.min() >= without.min() - NOISE.cap - 1e-9
    if far > 1.0:
        assert after == pytest.approx(without - NOISE.cap, abs=1e-9)


def test_a_wrong_place_costs_at_most_the_cap_of_every_contact(block: Surface) -> None:
    points, axes = touched(block, 4, seed=8)
    arrangement = arrange(turns(0.0), points, axes, anchor=0)
    samples, yaws = pairs(block, arrangement)
    found = scores(block, arrangement, samples, yaws) - np.log(block.areas[samples])
    assert found.max() <= 1e-12
    # The anchor's own place is exact, and its axis was asked for before.
    assert found.min() >= -4.0 * NOISE.cap


def test_moving_base_and_object_together_changes_no_score(block: Surface) -> None:
    points, axes = touched(block, 5, seed=3)
    here = arrange(turns(0.0, 5.0), points, axes, anchor=2)
    there = arrange(turns(0.0, 5.0), points + np.array([0.7, -2.0, 0.4]), axes, anchor=2)
    samples, yaws = pairs(block, here)
    for one, other in zip(pairs(block, there), (samples, yaws), strict=True):
        np.testing.assert_array_equal(one, other)
    # Differences of places near 2 m keep 4e-16 m.
    assert scores(block, there, samples, yaws) == pytest.approx(scores(block, here, samples, yaws), abs=1e-6)


def test_turning_bench_and_belief_together_changes_no_score(block: Surface) -> None:
    points, axes = touched(block, 5, seed=3)
    turned = rotation_about(UP, 0.9)
    here = arrange(turns(0.0), points, axes, anchor=2)
    there = arrange(turns(0.0) @ turned.T, points @ turned.T, axes @ turned.T, anchor=2)
    assert there.offsets == pytest.approx(here.offsets, abs=1e-15)
    assert there.axes == pytest.approx(here.axes, abs=1e-15)


def test_the_order_of_the_other_contacts_does_not_matter(block: Surface) -> None:
    points, axes = touched(block, 5, seed=3)
    order = np.array([0, 3, 1, 4, 2])
    here = arrange(turns(0.0), points, axes, anchor=0)
    samples, yaws = pairs(block, here)
    there = arrange(turns(0.0), points[order], axes[order], anchor=0)
    assert scores(block, there, samples, yaws) == pytest.approx(scores(block, here, samples, yaws), abs=1e-9)


@pytest.mark.parametrize("within", [5.0, 30.0])
def test_giving_up_early_loses_none_that_ends_near_the_best(block: Surface, within: float) -> None:
    points, axes = touched(block, 5, seed=3)
    arrangement = arrange(turns(-3.0, 0.0, 3.0), points, axes, anchor=1)
    samples, yaws = pairs(block, arrangement)
    whole = scores(block, arrangement, samples, yaws)
    pruned = scores(block, arrangement, samples, yaws, within=within)
    near = whole >= whole.max() - within
    np.testing.assert_array_equal(pruned[near], whole[near])
    given_up = pruned != whole
    assert np.all(np.isneginf(pruned[given_up]))
    assert given_up.any()


def test_the_anchors_tried_are_those_whose_normal_the_tool_can_have_faced(block: Surface) -> None:
    points, axes = touched(block, 3, seed=3)
    arrangement = arrange(turns(0.0, 30.0), points, axes, anchor=1)
    samples, yaws = pairs(block, arrangement)
    facing = -np.einsum("ij,ij->i", block.normals[samples], arrangement.axes[yaws, 1])
    limit = NOISE.free_angle + NOISE.angle * np.sqrt(2.0 * NOISE.cap)
    assert facing.min() > np.cos(limit)
    every, any_yaw = pairs(block, arrangement, use_axis=False)
    assert len(every) == 2 * len(block.points)
    assert len(np.unique(every * 2 + any_yaw)) == len(every)
    left_out = np.setdiff1d(every * 2 + any_yaw, samples * 2 + yaws)
    other = -np.einsum("ij,ij->i", block.normals[left_out // 2], arrangement.axes[left_out % 2, 1])
    assert other.max() <= np.cos(limit)


def test_a_contact_far_from_the_anchor_is_believed_less() -> None:
    """The object's scale and tilt move it: the sigmas add in quadrature with the distance."""
    points = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.0, 0.2]])
    arrangement = arrange(turns(0.0), points, np.tile(-UP, (3, 1)), anchor=0)
    expected = np.hypot(NOISE.gap, NOISE.gap_per_metre * np.array([0.0, 0.1, 0.2]))
    assert arrangement.gap_sigmas(NOISE) == pytest.approx(expected, abs=1e-15)
