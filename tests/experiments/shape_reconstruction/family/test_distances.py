"""Laws of the family's signed distances, on shapes drawn of every class."""

import numpy as np
import pytest

from experiments.shape_reconstruction.family import layout
from experiments.shape_reconstruction.family import revolution_distance as revolution
from experiments.shape_reconstruction.family.distance import (
    distance,
    distances,
    inside_depth,
    prepare,
)
from experiments.shape_reconstruction.family.field import corners_of, grid_distances
from experiments.shape_reconstruction.family.kind import FamilyShape
from experiments.shape_reconstruction.family.kinds import CLASSES, draw_shape
from experiments.shape_reconstruction.smooth.grid import isosurface
from harness.basics.arrays import FloatArray

DRAWS = 4
STEEPEST = 1.3
"""Of a distance near the surface: it is first order beside an ellipse's narrow ends."""

NEAR = 2e-3
"""M from the surface: what readings look at."""


def drawn(name: str) -> list[FamilyShape]:
    random = np.random.default_rng(7)
    return [draw_shape(name, random) for _ in range(DRAWS)]


def around(shape: FamilyShape, count: int, seed: int = 0) -> FloatArray:
    """``(count, 3)`` places in a box half as large again as the shape's."""
    corners = corners_of(shape)
    low, high = corners.min(axis=0), corners.max(axis=0)
    middle, half = 0.5 * (low + high), 0.75 * (high - low)
    return np.asarray(middle + half * np.random.default_rng(seed).uniform(-1.0, 1.0, (count, 3)))


def filled(shape: FamilyShape, points: FloatArray) -> FloatArray:
    q = np.empty(layout.PREPARED)
    prepare(shape.code, shape.theta, q)
    return np.array([distance(shape.code, q, True, *point) for point in points])


@pytest.mark.parametrize("name", CLASSES)
def test_a_distance_is_finite_and_near_the_surface_as_steep_as_space(name: str) -> None:
    for shape in drawn(name):
        points = around(shape, 1500)
        step = 1e-4 * np.random.default_rng(1).standard_normal(points.shape)
        here, there = (distances(shape.code, shape.theta, places) for places in (points, points + step))
        assert np.isfinite(here).all()
        slopes = np.abs(there - here) / np.linalg.norm(step, axis=1)
        assert (slopes[np.abs(here) < NEAR] <= STEEPEST).all()


@pytest.mark.parametrize("name", CLASSES)
def test_no_place_is_nearer_to_the_surface_than_its_distance_says(name: str) -> None:
    shape = drawn(name)[0]
    points = around(shape, 60)
    gaps = np.abs(distances(shape.code, shape.theta, points))
    directions = np.random.default_rng(2).standard_normal((200, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    for point, gap in zip(points, gaps, strict=True):
        inner = distances(shape.code, shape.theta, point + 0.7 * gap * directions)
        assert (np.sign(inner) == np.sign(inner[0])).all()


@pytest.mark.parametrize("name", CLASSES)
def test_everything_inside_is_in_the_body_s_box(name: str) -> None:
    for shape in drawn(name):
        points = around(shape, 600)
        q = np.empty(layout.PREPARED)
        prepare(shape.code, shape.theta, q)
        by_box = np.array([inside_depth(shape.code, q, *point) for point in points])
        np.testing.assert_array_equal(by_box, np.minimum(distances(shape.code, shape.theta, points), 0.0))


@pytest.mark.parametrize("name", CLASSES)
def test_a_body_moves_with_its_pose(name: str) -> None:
    shape = drawn(name)[0]
    points = around(shape, 100)
    moved = shape.theta.copy()
    moved[layout.X], moved[layout.Y], moved[layout.LIFT], moved[layout.YAW] = 0.02, -0.01, 0.003, 0.7
    cosine, sine = np.cos(0.7), np.sin(0.7)
    turned = np.column_stack(
        [
            cosine * points[:, 0] - sine * points[:, 1],
            sine * points[:, 0] + cosine * points[:, 1],
            points[:, 2],
        ]
    )
    there = distances(shape.code, moved, turned + np.array([0.02, -0.01, 0.003]))
    np.testing.assert_allclose(there, distances(shape.code, shape.theta, points), atol=1e-12)


@pytest.mark.slow  # a law of one kernel
@pytest.mark.parametrize("name", ["mug", "jug", "teapot", "spanner"])
def test_filling_holes_only_adds(name: str) -> None:
    for shape in drawn(name):
        points = around(shape, 300)
        inside = distances(shape.code, shape.theta, points) < 0.0
        assert (filled(shape, points)[inside] < 0.0).all()


@pytest.mark.parametrize("name", ["cup", "bowl", "plate", "tray", "stemmed glass", "vase"])
def test_a_cavity_only_takes_away(name: str) -> None:
    for shape in drawn(name):
        solid = shape.code.copy()
        solid[revolution.HOLLOW] = 0
        points = around(shape, 300)
        hollow = distances(shape.code, shape.theta, points)
        assert (hollow >= distances(solid, shape.theta, points) - 1e-12).all()


@pytest.mark.parametrize("name", CLASSES)
def test_a_grid_has_the_surface_s_distances_near_it_and_the_right_sign_elsewhere(name: str) -> None:
    shape = drawn(name)[0]
    corners = corners_of(shape)
    low, high = corners.min(axis=0) - 5e-3, corners.max(axis=0) + 5e-3
    cell = float((high - low).max()) / 40
    counts = np.ceil((high - low) / cell).astype(np.int64) + 1
    field = grid_distances(shape, low, cell, counts)
    axes = [low[axis] + cell * np.arange(counts[axis]) for axis in range(3)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    exact = distances(shape.code, shape.theta, points).reshape(field.shape)
    near = np.abs(exact) < cell
    np.testing.assert_allclose(field[near], exact[near], atol=1e-12)
    assert (np.sign(field) == np.sign(exact))[~near].all()


def flat_sided(radius: float, half_depth: float) -> FamilyShape:
    """A bottle of one radius all the way up, flattened to a half depth."""
    shape = drawn("flat bottle")[0]
    code, theta = shape.code.copy(), shape.theta.copy()
    code[revolution.PLAN] = revolution.FLAT_SIDED
    theta[revolution.SLOT.radii] = np.log(radius)
    theta[revolution.SLOT.radii[0]] = np.log(WIDEST)
    theta[revolution.SLOT.across] = np.log(half_depth / WIDEST)
    theta[revolution.SLOT.height] = np.log(0.2)
    return FamilyShape(shape.name, code, theta)


WIDEST = 0.05
"""M: radius of the foot."""


@pytest.mark.parametrize("radius", [0.012, 0.02, 0.045])
@pytest.mark.parametrize("half_depth", [0.025, 0.03])
def test_flat_sides_hold_the_depth_of_what_is_wider_and_what_is_narrower_is_round(
    radius: float, half_depth: float
) -> None:
    shape = flat_sided(radius, half_depth)
    deep = min(radius, half_depth)
    on_it = np.array([[radius, 0.0, 0.15], [0.0, deep, 0.15]])
    np.testing.assert_allclose(distances(shape.code, shape.theta, on_it), 0.0, atol=0.03 * deep)


def test_a_waist_leaves_flat_sides_upright() -> None:
    """Where the outline goes in and out again the depth does not, and the distance follows the flat side."""
    shape = flat_sided(0.07, 0.02)
    theta = shape.theta.copy()
    theta[revolution.SLOT.radii] += 0.3 * np.cos(np.arange(revolution.KNOTS) * np.pi)
    theta[revolution.SLOT.across] = np.log(0.02) - theta[revolution.SLOT.radii].max()
    up = np.linspace(0.02, 0.18, 50)
    for off in (-1e-3, 0.0, 1e-3):
        beside = np.column_stack([np.zeros(50), np.full(50, 0.02 + off), up])
        np.testing.assert_allclose(distances(shape.code, theta, beside), off, atol=2e-4)


def test_a_can_has_the_volume_of_a_cylinder() -> None:
    shape = drawn("can")[0]
    theta = shape.theta.copy()
    theta[revolution.SLOT.radii] = np.log(0.03)
    theta[revolution.SLOT.height] = np.log(0.1)
    low, cell = np.array([-0.035, -0.035, -0.005]), 1e-3
    counts = np.array([71, 71, 111])
    surface = isosurface(grid_distances(FamilyShape("can", shape.code, theta), low, cell, counts), low, cell)
    volume = (
        float(
            np.einsum(
                "ij,ij->i", surface.corners[:, 0], np.cross(*surface.corners[:, 1:].swapaxes(0, 1))
            ).sum()
        )
        / 6.0
    )
    assert volume == pytest.approx(np.pi * 0.03**2 * 0.1, rel=0.01)
