"""One ray and one triangle: what is met, what is missed, and by which sums."""

import numpy as np
import pytest

from harness.basics.arrays import FloatArray
from harness.basics.faces.mesh_rays import first_distances, is_inside
from harness.basics.faces.ray_mesh import ON_EDGE, RayMesh, meeting, triangles_of
from harness.objects.household import build

FLAT = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
UP = np.array([0.0, 0.0, 1.0])


def met(start: FloatArray, direction: FloatArray, corners: FloatArray, wider: float = 0.0) -> FloatArray:
    return np.array(meeting(start, direction, triangles_of(corners[None])[0], wider))


def as_published(o: list[float], d: list[float], p: list[list[float]]) -> tuple[float, float, float]:
    """The published sums in Python's own float64, in the published order."""

    def cross(a: list[float], b: list[float]) -> list[float]:
        return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]

    def dot(a: list[float], b: list[float]) -> float:
        return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]

    normal = cross(d, p[2])
    s = [o[axis] - p[0][axis] for axis in range(3)]
    q, volume = cross(s, p[1]), dot(p[1], normal)
    return dot(p[2], q) / volume, dot(s, normal) / volume, dot(d, q) / volume


def test_the_sums_are_the_published_ones_to_the_bit() -> None:
    random = np.random.default_rng(0)
    for _ in range(500):
        corners, start = random.normal(size=(3, 3)), random.normal(size=3)
        direction = random.dirichlet(np.ones(3)) @ corners - start
        triangle = triangles_of(corners[None])[0]
        expected = as_published(start.tolist(), direction.tolist(), triangle.tolist())
        assert meeting(start, direction, triangle, ON_EDGE) == expected
        assert expected[0] == pytest.approx(1.0)


def test_a_triangle_is_met_from_both_sides_and_behind() -> None:
    above = np.array([0.25, 0.5, 2.0])
    assert met(above, -UP, FLAT).tolist() == [2.0, 0.25, 0.5]
    assert met(above, UP, FLAT).tolist() == [-2.0, 0.25, 0.5]
    assert met(above, -UP, FLAT[::-1].copy())[0] == 2.0
    assert np.isnan(met(np.array([0.6, 0.6, 2.0]), -UP, FLAT)[0])


@pytest.mark.parametrize(
    "at", [[0.0, 0.3, 1.0], [0.3, 0.0, 1.0], [0.5, 0.5, 1.0], [0.0, 0.0, 1.0], [1.0, 0.0, 1.0]]
)
def test_borders_belong_to_it_and_a_wider_one_reaches_beyond(at: list[float]) -> None:
    start = np.array(at)
    assert met(start, -UP, FLAT)[0] == 1.0
    outward = start - [1.0 / 3.0, 1.0 / 3.0, 1.0]
    beyond = start + 1e-6 * outward
    assert np.isnan(met(beyond, -UP, FLAT)[0])
    assert met(beyond, -UP, FLAT, 1e-5)[0] == 1.0


@pytest.mark.parametrize(
    "corners", [FLAT[[0, 0, 0]], FLAT[[0, 1, 1]], np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]])]
)
def test_what_has_no_area_or_is_seen_edge_on_is_not_met(corners: FloatArray) -> None:
    assert np.isnan(met(np.array([0.5, 0.0, 1.0]), -UP, corners, ON_EDGE)[0])
    assert np.isnan(met(np.array([-1.0, 0.2, 0.0]), np.array([1.0, 0.0, 0.0]), FLAT, ON_EDGE)[0])


def test_all_triangles_one_by_one_say_what_the_grid_says() -> None:
    mesh = build("mug", 8e-3)
    random = np.random.default_rng(1)
    starts = mesh.bounds.mean(axis=0) + random.normal(size=(300, 3)) * 0.1
    towards = mesh.vertices[random.integers(len(mesh.vertices), size=300)] - starts
    towards /= np.linalg.norm(towards, axis=1)[:, None]
    hits = RayMesh(mesh).first_hits(starts, towards)
    found = first_distances(starts, towards, mesh.corners)
    assert np.isfinite(found).all()  # every ray is aimed at a corner, and none slips through
    np.testing.assert_allclose(found, hits.distance, rtol=0, atol=1e-12)


def test_what_is_inside_a_wall_is_inside() -> None:
    mesh = build("mug", 8e-3)
    random = np.random.default_rng(2)
    faces = random.choice(len(mesh.faces), 50)
    middles = mesh.corners[faces].mean(axis=1)
    within, without = (middles + side * 1e-4 * mesh.face_normals[faces] for side in (-1.0, 1.0))
    assert is_inside(within, mesh.corners).all()
    assert not is_inside(without, mesh.corners).any()
