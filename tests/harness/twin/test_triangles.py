"""What meets a triangle, against closed forms and dense samples."""

import numpy as np
import pytest

from harness.basics.arrays import FloatArray
from harness.basics.errors import MeshRefused
from harness.basics.geometry import apply, inverse, rotation_from_vector, transform, translation
from harness.basics.mesh import Mesh
from harness.twin.triangles import ConvexBody, Solid

HALF = np.array([0.03, 0.02, 0.01])
BOX = ConvexBody.box(-HALF, HALF)


def one_triangle(corners: FloatArray) -> Solid:
    return Solid(Mesh(corners, np.array([[0, 1, 2]])))


def samples(corners: FloatArray, count: int = 60) -> FloatArray:
    """A dense lattice of points on one triangle, its corners and edges included."""
    u, v = np.meshgrid(np.linspace(0, 1, count), np.linspace(0, 1, count))
    inside = u + v <= 1 + 1e-12
    u, v = u[inside][:, None], v[inside][:, None]
    points: FloatArray = corners[0] + u * (corners[1] - corners[0]) + v * (corners[2] - corners[0])
    return points


def random_pose(rng: np.random.Generator) -> FloatArray:
    return transform(rotation_from_vector(rng.normal(size=3)), rng.normal(size=3) * 0.03)


def test_a_box_meets_a_triangle_exactly_when_some_of_it_lies_inside() -> None:
    rng = np.random.default_rng(0)
    met = 0
    for _ in range(400):
        corners, pose = rng.normal(size=(3, 3)) * 0.04, random_pose(rng)
        inside = np.abs(apply(inverse(pose), samples(corners))) / HALF
        nearest = inside.max(axis=1).min()  # below one: inside
        answer = one_triangle(corners).meets(BOX, pose, 0.0)
        met += answer
        if nearest <= 1.0:
            assert answer
        elif nearest > 1.25:  # the lattice is coarse beside a thin corner
            assert not answer
    assert 50 < met < 350


def test_a_clearance_moves_every_face_out() -> None:
    triangle = one_triangle(np.array([[0.0, 0.0, 0.012], [0.005, 0.0, 0.012], [0.0, 0.005, 0.012]]))
    assert not triangle.meets(BOX, np.eye(4), 1.9e-3)
    assert triangle.meets(BOX, np.eye(4), 2.1e-3)


def test_a_triangle_far_larger_than_the_body_is_met_inside_its_face() -> None:
    wall = one_triangle(np.array([[-5.0, -5.0, 0.0], [5.0, -5.0, 0.0], [0.0, 9.0, 0.0]]))
    assert wall.meets(BOX, translation(np.array([0.3, 0.1, 0.0099])), 0.0)
    assert not wall.meets(BOX, translation(np.array([0.3, 0.1, 0.0101])), 0.0)


def test_the_least_height_within_a_body_is_that_of_the_part_inside() -> None:
    slope = one_triangle(np.array([[-1.0, -1.0, -0.1], [1.0, -1.0, 0.1], [0.0, 1.0, 0.0]]))  # z = x / 10
    assert Solid.least_along(slope, BOX, np.eye(4)) == pytest.approx(-0.1 * HALF[0], abs=1e-12)
    away = one_triangle(np.array([[1.0, 1.0, 0.0], [2.0, 1.0, 0.0], [1.0, 2.0, 0.0]]))
    assert Solid.least_along(away, BOX, np.eye(4)) == np.inf


def test_the_least_height_is_that_of_a_dense_sample() -> None:
    rng = np.random.default_rng(3)
    for _ in range(100):
        corners, pose = rng.normal(size=(3, 3)) * 0.02, random_pose(rng)
        points = apply(inverse(pose), samples(corners, 200))
        inside = points[np.all(np.abs(points) <= HALF, axis=1)]
        least = one_triangle(corners).least_along(BOX, pose)
        if len(inside) > 20:
            assert least <= inside[:, 2].min() + 1e-12
            assert least > inside[:, 2].min() - 1e-3


def test_the_nearest_point_is_no_further_than_any_sample() -> None:
    rng = np.random.default_rng(1)
    for _ in range(100):
        corners, point = rng.normal(size=(3, 3)), rng.normal(size=3)
        nearest = one_triangle(corners).nearest(point)
        gaps = np.linalg.norm(samples(corners, 100) - point, axis=1)
        gap = float(np.linalg.norm(nearest - point))
        assert gap <= gaps.min() + 1e-12
        assert gap > gaps.min() - 0.05


def test_a_line_meets_the_first_of_two_walls_and_passes_a_window() -> None:
    near = np.array([[-1.0, -1.0, 1.0], [1.0, -1.0, 1.0], [0.0, 1.0, 1.0]])
    walls = Solid(
        Mesh(np.concatenate([near, near + np.array([0.0, 0.0, 1.0])]), np.array([[3, 4, 5], [0, 1, 2]]))
    )
    along = np.array([0.0, 0.0, 1.0])
    assert walls.first_hit(np.zeros(3), along) == pytest.approx(1.0, abs=1e-15)
    assert walls.first_hit(np.array([0.0, 0.0, 1.5]), along) == pytest.approx(0.5, abs=1e-15)
    assert walls.first_hit(np.array([0.0, 1.1, 0.0]), along) == np.inf
    assert walls.first_hit(np.zeros(3), -along) == np.inf


def test_a_triangle_without_area_is_no_surface() -> None:
    flat = Mesh(
        np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1]]),
        np.array([[0, 1, 2], [0, 0, 1], [3, 4, 5]]),
    )
    assert np.allclose(Solid(flat).nearest(np.array([0.2, 0.2, 0.0])), [0.2, 0.2, 1.0])


def test_the_planes_of_a_hull_hold_its_points() -> None:
    points = np.random.default_rng(2).normal(size=(200, 3))
    body = ConvexBody.of_points(points)
    assert (points @ body.planes[:, :3].T + body.planes[:, 3]).max() < 1e-10
    assert not np.all((points * 1.2) @ body.planes[:, :3].T + body.planes[:, 3] < 0)


def test_a_flat_sheet_is_no_body_that_stands_on_the_bench() -> None:
    corners = 0.1 * np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    sheet = Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]))
    with pytest.raises(MeshRefused, match="100 x 100 x 0 mm"):
        _ = Solid(sheet).hull
