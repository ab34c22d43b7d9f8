"""Rays and faces: every face asked one by one says the same, edges leak nothing, no ray is too odd."""

import numpy as np
import pytest

from harness.basics.arrays import FloatArray
from harness.basics.errors import MeshRefused, OutOfDomain
from harness.basics.faces.ray_mesh import RayMesh
from harness.basics.mesh import Mesh
from harness.objects.household import build
from tests.oracles.seen_shapes import ball, cuboid, square, together

NO_FACE = -np.ones(1, np.int64)


def asked_one_by_one(mesh: Mesh, origins: FloatArray, directions: FloatArray) -> FloatArray:
    """``(n,)`` distances by a plain loop over all faces, each as a linear system."""
    found = np.full(len(origins), np.inf)
    for corners in mesh.corners:
        edges = np.stack([corners[1] - corners[0], corners[2] - corners[0]])
        systems = np.concatenate([np.broadcast_to(edges, (len(origins), 2, 3)), -directions[:, None]], axis=1)
        solvable = np.abs(np.linalg.det(systems)) > 0.0
        safe = np.where(solvable[:, None, None], systems, np.eye(3))
        u, v, t = np.linalg.solve(safe.transpose(0, 2, 1), (origins - corners[0])[..., None])[..., 0].T
        met = solvable & (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
        found = np.where(met, np.minimum(found, t), found)
    return found


def unit_vectors(count: int, seed: int) -> FloatArray:
    drawn = np.random.default_rng(seed).standard_normal((count, 3))
    return np.asarray(drawn / np.linalg.norm(drawn, axis=1, keepdims=True))


@pytest.mark.parametrize(
    ("name", "away"),
    [("mug", 0.0), ("wrench", 0.3), ("mug", 25.0), pytest.param("tray", 0.3, marks=pytest.mark.slow)],
)
def test_all_faces_asked_one_by_one_say_the_same(name: str, away: float) -> None:
    mesh = build(name, 10e-3)
    centre = mesh.bounds.mean(axis=0)
    random = np.random.default_rng(3)
    origins = centre + away * unit_vectors(100, 1) + random.uniform(-0.02, 0.02, (100, 3))
    targets = mesh.bounds[0] + random.random((100, 3)) * (mesh.bounds[1] - mesh.bounds[0])
    directions = (targets - origins) / np.linalg.norm(targets - origins, axis=1, keepdims=True)
    hits = RayMesh(mesh).first_hits(origins, directions)
    expected = asked_one_by_one(mesh, origins, directions)
    assert np.isfinite(expected).sum() > 30
    np.testing.assert_array_equal(np.isfinite(hits.distance), np.isfinite(expected))
    met = np.isfinite(expected)
    # Rounding of a place 25 m away.
    np.testing.assert_allclose(hits.distance[met], expected[met], rtol=0, atol=1e-12)
    corners = mesh.corners[hits.face[met]]
    u, v = hits.weights[met].T[..., None]
    places = (1 - u - v) * corners[:, 0] + u * corners[:, 1] + v * corners[:, 2]
    np.testing.assert_allclose(places, origins[met] + hits.distance[met, None] * directions[met], atol=1e-10)


def test_a_closed_surface_lets_nothing_out_not_even_through_edges_and_corners() -> None:
    mesh = ball(0.05, 3)
    rays = RayMesh(mesh)
    edges = mesh.vertices[np.vstack([mesh.faces[:, :2], mesh.faces[:, 1:]])]
    aims = np.vstack([mesh.vertices, edges.mean(axis=1), 0.3 * edges[:, 0] + 0.7 * edges[:, 1]])
    for start in (np.zeros(3), np.array([0.01, -0.02, 0.003])):
        hits = rays.first_hits(start, aims - start)
        assert (hits.face >= 0).all()
        np.testing.assert_allclose(hits.distance, np.linalg.norm(aims - start, axis=1), rtol=1e-8)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_rays_along_an_axis_meet_a_box_on_its_borders_and_inside(axis: int, sign: float) -> None:
    rays = RayMesh(cuboid(0.04, 0.06, 0.08))
    half = np.array([0.02, 0.03, 0.04])
    across = [a for a in range(3) if a != axis]
    direction = np.zeros(3)
    direction[axis] = -sign
    steps = np.linspace(-1.0, 1.0, 9)
    origins = np.zeros((81, 3))
    origins[:, across[0]], origins[:, across[1]] = (
        grid.ravel() * half[a] for grid, a in zip(np.meshgrid(steps, steps), across, strict=True)
    )
    origins[:, axis] = 3.0 * sign * half[axis]
    hits = rays.first_hits(origins, np.tile(direction, (81, 1)))
    np.testing.assert_allclose(hits.distance, 2.0 * half[axis], rtol=1e-12)
    origins[:, across[0]] *= 1.001
    outside = np.abs(origins[:, across[0]]) > half[across[0]]
    missed = rays.first_hits(origins, np.tile(direction, (81, 1)))
    np.testing.assert_array_equal(missed.face < 0, outside)


def test_from_inside_the_inner_side_is_met() -> None:
    hits = RayMesh(ball(0.05, 4)).first_hits(np.zeros(3), unit_vectors(500, 4))
    np.testing.assert_allclose(hits.distance, 0.05, rtol=2e-3)


def test_a_thin_wall_shades_and_is_met_on_its_near_side() -> None:
    wall = together(square(0.1, z=0.0), square(0.1, z=5e-4))
    rays = RayMesh(wall)
    origins = np.column_stack([np.linspace(-0.04, 0.04, 50), np.full(50, 0.003), np.full(50, 0.2)])
    hits = rays.first_hits(origins, np.tile([0.0, 0.0, -1.0], (50, 1)))
    np.testing.assert_allclose(hits.distance, 0.2 - 5e-4, rtol=1e-12)
    below = origins * [1.0, 1.0, 0.0]
    faces = np.where(below[:, 0] > below[:, 1], 0, 1)
    assert not rays.free(below, np.array([0.0, 0.0, 1.0]), faces).any()
    assert rays.free(below, np.array([0.0, 0.0, -1.0]), faces).all()


@pytest.mark.parametrize("towards", [(0.3, 0.2, 1.0), (1.0, 0.0, 1e-3), (1.0, 0.0, 0.0)])
def test_a_convex_surface_does_not_shade_itself(towards: tuple[float, float, float]) -> None:
    mesh = ball(0.05, 3)
    light = np.array(towards) / np.linalg.norm(towards)
    lit = np.flatnonzero(mesh.face_normals @ light > 1e-6)
    random = np.random.default_rng(5).dirichlet(np.ones(3), (len(lit), 20))
    places = np.einsum("nkc,ncx->nkx", random, mesh.corners[lit]).reshape(-1, 3)
    assert RayMesh(mesh).free(places, light, np.repeat(lit, 20)).all()


@pytest.mark.parametrize("length", [1e-200, 1e-3, 1e200])
def test_a_direction_may_have_any_length(length: float) -> None:
    rays = RayMesh(ball(0.05, 2))
    directions = unit_vectors(20, 6)
    one, other = rays.first_hits(np.zeros(3), directions), rays.first_hits(np.zeros(3), length * directions)
    np.testing.assert_allclose(other.distance, one.distance, rtol=1e-12)


def test_no_rays_meet_nothing() -> None:
    rays = RayMesh(ball(0.05, 1))
    assert len(rays.first_hits(np.zeros(3), np.zeros((0, 3))).face) == 0
    assert len(rays.free(np.zeros((0, 3)), np.array([0.0, 0.0, 1.0]), np.zeros(0, np.int64))) == 0


@pytest.mark.parametrize(
    ("origin", "direction", "said"),
    [
        ((0, 0, 0), (0, 0, 0), "ray 0 of 1 .*direction"),
        ((0, 0, np.nan), (0, 0, 1), "finite"),
        ((0, 0, 0), (0, np.inf, 1), "finite"),
    ],
)
def test_a_ray_that_is_none_is_refused(origin: FloatArray, direction: FloatArray, said: str) -> None:
    rays = RayMesh(ball(0.05, 1))
    starts, ways = np.array([origin], np.float64), np.array([direction], np.float64)
    with pytest.raises(OutOfDomain, match=said):
        rays.first_hits(starts, ways)
    with pytest.raises(OutOfDomain, match=said):
        rays.free(starts, ways, NO_FACE)


def test_a_mesh_without_faces_is_refused() -> None:
    with pytest.raises(MeshRefused, match="0 faces"):
        RayMesh(Mesh(np.zeros((3, 3)), np.zeros((0, 3), np.int64)))
