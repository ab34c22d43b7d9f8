"""Laws of the likelihood and of the fit, on readings made from shapes of the family itself."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.shape_reconstruction.evidence import GuardedTouch
from experiments.shape_reconstruction.family import layout, tool
from experiments.shape_reconstruction.family import revolution_distance as revolution
from experiments.shape_reconstruction.family.contact_fit import contact_fit
from experiments.shape_reconstruction.family.distance import distances
from experiments.shape_reconstruction.family.freedom import basis_of, bench_rows, prior_rows, shape_rows
from experiments.shape_reconstruction.family.kind import FamilyShape
from experiments.shape_reconstruction.family.kinds import draw_shape, rarity
from experiments.shape_reconstruction.family.observed import PASS, FamilyEvidence, observe
from experiments.shape_reconstruction.family.posterior import mixture_of
from experiments.shape_reconstruction.family.proposals import guides_of, place_sample
from experiments.shape_reconstruction.family.residuals import evaluate, make_rows, prepared_buffer
from experiments.shape_reconstruction.family.search import (
    LEVELS,
    FamilySearch,
    PriorRows,
    cheapest,
    minimize,
    total_cost,
)
from experiments.shape_reconstruction.thresholds import SOLID_RARITY
from harness.basics.geometry import apply, transform, translation
from tests.support.family_readings import made, nudged
from tests.support.family_shapes import SHAPES
from tests.support.shape_readings import missed, shape_readings


def cost_of(shape: FamilyShape, seen: FamilyEvidence, robust: bool = True) -> float:
    return float(evaluate(shape.code, shape.theta, seen, robust, make_rows(seen), prepared_buffer(), np.inf))


def prior_of(shape: FamilyShape) -> PriorRows:
    rows = prior_rows(bench_rows(0.02, 1e-3, 2e-3, 3e-3, 5e-3), shape_rows(shape.code))
    middle = shape.theta.copy()
    middle[: layout.POSE_SIZE] = 0.0
    return PriorRows(middle, rows)


@pytest.mark.parametrize("name", SHAPES)
def test_a_shape_that_costs_more_than_is_asked_for_is_left_and_no_other(name: str) -> None:
    shape, evidence = made(name)
    seen, q, prior = observe(evidence), prepared_buffer(), prior_of(shape)
    tried = np.array([nudged(shape, 0.2, seed) for seed in range(6)])
    costs = [total_cost(shape.code, one, seen, prior, False, make_rows(seen), q, np.inf) for one in tried]
    best, least = cheapest(shape.code, tried, seen, prior, False, make_rows(seen), q)
    assert (best, least) == (int(np.argmin(costs)), min(costs))
    for one in tried:
        whole, out = make_rows(seen), make_rows(seen)
        cost = evaluate(shape.code, one, seen, False, whole, q, np.inf)
        assert evaluate(shape.code, one, seen, False, out, q, (1.0 + 1e-9) * cost) == cost
        assert np.array_equal(out.values, whole.values)
        for share in (0.0, 0.3, 0.9, 0.999):
            assert evaluate(shape.code, one, seen, False, out, q, share * cost) == np.inf


@pytest.mark.parametrize("name", [pytest.param("mug", marks=pytest.mark.slow), *SHAPES[1:]])
def test_a_shape_fits_its_own_readings_better_than_its_neighbours_do(name: str) -> None:
    shape, evidence = made(name)
    seen = observe(evidence)
    own = cost_of(shape, seen)
    assert own < 1.5 * len(seen.middles) + 0.1 * len(seen.rays.kinds)
    for seed in range(5):
        other = FamilyShape(name, shape.code, nudged(shape, 0.3, seed))
        assert cost_of(other, seen) > own


def across_a_shaft(depth: float) -> tuple[FamilyShape, GuardedTouch]:
    """A tool, and a press across its shaft from above: the gel hangs over both of its sides."""
    shape = made("spanner")[0]
    theta = shape.theta.copy()
    theta[: layout.POSE_SIZE] = 0.0
    theta[[tool.SLOT.shaft_a, tool.SLOT.shaft_b, tool.SLOT.shaft_thick]] = np.log(5e-3)
    shape = FamilyShape(shape.name, shape.code, theta)
    above = np.column_stack([np.zeros((400, 2)), np.linspace(0.0, 0.1, 400)])
    top = above[np.flatnonzero(distances(shape.code, theta, above) < 0.0)[-1], 2]
    along, across = np.meshgrid(np.linspace(-7e-3, 7e-3, 9), np.linspace(-9e-3, 9e-3, 11))
    in_gel = np.column_stack([along.ravel(), across.ravel(), np.zeros(along.size)])
    pose = transform(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, top - depth]))
    face = apply(pose, in_gel)
    met = distances(shape.code, theta, face) < 0.0
    points = face[met] + np.array([0.0, 0.0, depth])
    normals = np.repeat([[0.0, 0.0, 1.0]], len(points), axis=0)
    return shape, GuardedTouch(pose, 30e-3, points, normals, 0.6e-3, 0.05, 0, face[~met])


@pytest.mark.parametrize("off", [0.0, 1e-3, -1e-3])
def test_what_the_gel_touched_nothing_of_is_not_of_the_object(off: float) -> None:
    shape, touch = across_a_shaft(1e-3)
    shift = np.array([0.0, 0.0, off])  # an error that all places of the contact share
    touch = replace(touch, points=touch.points + shift, clear=touch.clear + shift)
    wide = FamilyShape(shape.name, shape.code, shape.theta.copy())
    wide.theta[[tool.SLOT.shaft_a, tool.SLOT.shaft_b]] += np.log(3.0)
    told, untold = (
        observe(shape_readings((one,), None)) for one in (touch, replace(touch, clear=np.empty((0, 3))))
    )
    assert cost_of(shape, told) == pytest.approx(cost_of(shape, untold))
    assert cost_of(wide, told) > cost_of(wide, untold) + 2.0


@pytest.mark.parametrize("name", SHAPES)
def test_refining_never_costs_more_and_finds_the_way_back(name: str) -> None:
    shape, evidence = made(name)
    seen, prior = observe(evidence), prior_of(shape)
    theta = nudged(shape, 0.15)
    basis = basis_of(shape.code, True, True)
    before = total_cost(shape.code, theta, seen, prior, False, make_rows(seen), prepared_buffer(), np.inf)
    costs = [before]
    for rounds in (2, 12):
        found, cost, curvature = minimize(shape.code, theta, seen, prior, basis, False, rounds, True)
        costs.append(cost)
        assert np.isfinite(found).all()
        assert np.linalg.eigvalsh(curvature).min() >= -1e-6 * np.abs(curvature).max()
    assert costs[0] >= costs[1] >= costs[2]
    assert costs[2] < 0.2 * costs[0]


def test_a_slipped_contact_pulls_with_a_force_that_dies_away() -> None:
    shape, evidence = made("mug")
    costs = []
    for slip in (0.0, 5e-3, 10e-3, 20e-3):
        first, *rest = evidence.touches
        away = first.stand_from_gel[:3, 2] * -slip
        slipped = replace(first, points=apply(translation(away), first.points))
        costs.append(cost_of(shape, observe(replace(evidence, touches=(slipped, *rest), look=None))))
    rises = np.diff(costs)
    assert rises[0] > rises[1] > 0.0
    assert rises[2] < 3.0 * rises[1]


def test_a_slipped_contact_is_named_and_no_other() -> None:
    shape, evidence = made("mug")
    touches = list(evidence.touches)
    away = touches[2].stand_from_gel[:3, 2] * -6e-3
    touches[2] = replace(touches[2], points=apply(translation(away), touches[2].points))
    fit = contact_fit(shape, observe(replace(evidence, touches=tuple(touches))))
    assert np.flatnonzero(fit.doubtful).tolist() == [2]
    assert fit.off[2] == pytest.approx(6e-3, rel=0.35)


def test_a_gel_that_went_through_the_body_and_met_nothing_costs() -> None:
    shape, evidence = made("bowl")
    above = evidence.touches[0].stand_from_gel.copy()
    above[:3, :3] = np.diag([1.0, -1.0, -1.0])
    through, beside = above.copy(), above.copy()
    through[:3, 3], beside[:3, 3] = [0.0, 0.0, 1e-3], [0.5, 0.0, 1e-3]
    costs = [
        cost_of(shape, observe(shape_readings((missed(evidence.touches[0], pose),), None)))
        for pose in (through, beside)
    ]
    assert costs[1] == 0.0
    assert costs[0] > 3.0


def test_a_vessel_in_front_of_what_was_not_seen_costs_the_same_however_thin_its_wall_is() -> None:
    _, readings = made("bottle")
    seen = observe(replace(readings, touches=()))
    costs = []
    for wall in (1e-3, 8e-3):
        tray = draw_shape("tray", np.random.default_rng(0))
        tray.theta[revolution.SLOT.wall] = np.log(wall)
        costs.append(cost_of(tray, seen))
    assert costs[0] == pytest.approx(costs[1], rel=1e-9)


def test_a_thin_board_far_outside_of_the_mask_is_wrong_by_more_than_it_is_thick() -> None:
    _, readings = made("mug")
    seen = observe(replace(readings, touches=()))
    board = draw_shape("board", np.random.default_rng(0))
    board.theta[revolution.SLOT.height], board.theta[layout.X] = np.log(0.06), 0.12
    out = make_rows(seen)
    evaluate(board.code, board.theta, seen, False, out, prepared_buffer(), np.inf)
    passing = out.values[-len(seen.rays.kinds) :][seen.rays.kinds == PASS]
    met = passing[passing < 0.0]
    thick = np.exp(board.theta[revolution.SLOT.radii[0]])
    assert len(met) > 3
    assert np.median(-met) * seen.rays.pixel > 3.0 * thick


def test_a_hypothesis_found_twice_counts_once() -> None:
    shape, readings = made("mug")
    search = FamilySearch(readings, LEVELS["coarse"])
    best = search.refine(search.start(shape, shape.theta), 8, last=True)
    near = replace(shape, theta=best.shape.theta + 1e-5)
    beside = search.refine(search.start(near, shape.theta), 1, last=True)
    assert len(mixture_of([best, beside], True, True, 0).hypotheses) == 1


def test_looking_beside_the_best_finds_better_and_loses_nothing_that_was_likely() -> None:
    gained = 0.0
    for name in ("tray", "spanner"):
        _, readings = made(name)
        without, with_hops = (
            FamilySearch(readings, replace(LEVELS["coarse"], hops=hops)).run() for hops in (0, 2)
        )
        assert with_hops[0].cost < without[0].cost + 1e-3
        likely = {one.shape.code.tobytes() for one in without[: LEVELS["coarse"].finals - 1]}
        assert likely <= {one.shape.code.tobytes() for one in with_hops}
        gained += without[0].cost - with_hops[0].cost
    assert gained > 0.1


def test_sides_are_proposed_that_span_the_contacts() -> None:
    _, readings = made("tray")
    guides, random = guides_of(readings), np.random.default_rng(0)
    low, high = guides.places.min(axis=0), guides.places.max(axis=0)
    fitting = 0
    for _ in range(40):
        for laid in place_sample(draw_shape("tray", random), guides, random, readings.place_error, 4):
            if abs(np.sin(2.0 * laid[layout.YAW])) > 0.2:
                continue
            corner = np.exp(laid[revolution.SLOT.radii].max())
            sides = 2.0 * (np.exp(laid[[revolution.SLOT.core_x, revolution.SLOT.core_y]]) + corner)
            fitting += bool((np.abs(np.sort(sides) / np.sort(high - low)[1:] - 1.1) < 0.12).all())
    assert fitting >= 5


def test_a_vessel_much_longer_than_wide_is_rare() -> None:
    tray = draw_shape("tray", np.random.default_rng(0))
    ordinary = rarity(tray)
    tray.theta[[revolution.SLOT.core_x, revolution.SLOT.core_y]] = np.log([0.2, 0.001])
    assert rarity(tray) == pytest.approx(ordinary + SOLID_RARITY)
    solid = draw_shape("packet", np.random.default_rng(0))
    before = rarity(solid)
    solid.theta[[revolution.SLOT.core_x, revolution.SLOT.core_y]] = np.log([0.2, 0.001])
    assert rarity(solid) == pytest.approx(before)


def test_a_normal_counts_for_less_where_the_surface_bends_within_a_contact() -> None:
    _, readings = made("bowl")
    flat = readings.contacts[0]
    lean = 0.6 * np.linspace(-1.0, 1.0, len(flat.points))
    across = np.cross(
        flat.mean_normal, [0.0, 0.0, 1.0] if abs(flat.mean_normal[2]) < 0.9 else [1.0, 0.0, 0.0]
    )
    across /= np.linalg.norm(across)
    bent = np.cos(lean)[:, None] * flat.mean_normal + np.sin(lean)[:, None] * across
    plane = np.repeat(flat.mean_normal[None], len(flat.points), axis=0)
    away = np.array([0.02, 0.0, 0.0])  # at another place, so that both count
    stand_from_gel = flat.stand_from_gel.copy()
    stand_from_gel[:3, 3] += away
    elsewhere = replace(flat, normals=bent, points=flat.points + away, stand_from_gel=stand_from_gel)
    seen = observe(replace(readings, touches=(replace(flat, normals=plane), elsewhere)))
    np.testing.assert_allclose(seen.normals[0], seen.normals[1], atol=1e-9)
    at_plane, at_rim = seen.normal_sigma
    assert at_plane == pytest.approx(np.hypot(flat.normal_sigma, np.radians(6.0)), rel=1e-6)
    assert at_rim > 1.5 * at_plane
