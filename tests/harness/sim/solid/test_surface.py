"""Samples of a surface: none missing, none too close, areas and normals of the mesh itself."""

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from harness.basics.errors import MeshRefused
from harness.basics.faces.nearest_surface import nearest_point
from harness.basics.mesh import Mesh
from harness.objects.household import build
from harness.sim.solid.surface_samples import (
    NEIGHBOURS,
    Surface,
    random_points,
    sample_surface,
    thin,
    voxel_table,
)
from tests.samples.synthetic_press import box, solid

SPACING = 2.5e-3
WALL = 1.5e-3
SHAPES = {
    "box": box(0.06, 0.04, 0.03),
    "ball": solid(trimesh.creation.icosphere(subdivisions=3, radius=0.025)),
    # A wall thinner than the spacing: both of its faces must be sampled.
    "sheet": box(0.06, 0.04, WALL),
    "wrench": build("wrench", edge=6e-3),
}


@pytest.fixture(scope="module", params=list(SHAPES))
def sampled(request: pytest.FixtureRequest) -> tuple[Mesh, Surface]:
    mesh = SHAPES[request.param]
    return mesh, sample_surface(mesh, SPACING)


def test_hardly_a_place_is_farther_than_the_spacing_from_a_sample_that_faces_its_way(
    sampled: tuple[Mesh, Surface],
) -> None:
    """Samples are chosen from random points, so a gap may be somewhat wider here and there."""
    mesh, surface = sampled
    places, faces = random_points(mesh, 4000, np.random.default_rng(99))
    facing = mesh.face_normals[faces]
    near = surface.tree.query_ball_point(places, 1.2 * SPACING)
    gaps = np.full(len(places), np.inf)
    for n, index in enumerate(near):
        # At the rim of a bevel the smoothed normals differ by up to the 60 degrees of one side.
        alike = np.asarray(index)[surface.normals[index] @ facing[n] > 0.45]
        gaps[n] = np.linalg.norm(surface.points[alike] - places[n], axis=1).min(initial=np.inf)
    assert gaps.max() < 1.2 * SPACING
    assert np.mean(gaps > SPACING) < 1e-3


def test_samples_lie_on_the_mesh(sampled: tuple[Mesh, Surface]) -> None:
    mesh, surface = sampled
    for point in surface.points[::20]:
        assert np.linalg.norm(nearest_point(mesh, point) - point) < 1e-12


def test_the_areas_are_the_meshs(sampled: tuple[Mesh, Surface]) -> None:
    mesh, surface = sampled
    assert surface.areas.sum() == pytest.approx(mesh.face_areas.sum(), rel=1e-9)
    assert surface.areas.min() > 0.0
    # Even samples: none stands for more than a full disc of the spacing.
    assert surface.areas.max() < np.pi * SPACING**2


def test_normals_are_unit_and_outward(sampled: tuple[Mesh, Surface]) -> None:
    mesh, surface = sampled
    assert np.linalg.norm(surface.normals, axis=1) == pytest.approx(1.0, abs=1e-12)
    whole = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    step = 0.2e-3 * surface.normals
    assert not whole.contains(surface.points + step).any()
    assert whole.contains(surface.points - step).mean() > 0.99


def test_the_normals_of_a_ball_point_from_its_centre() -> None:
    surface = sample_surface(SHAPES["ball"], SPACING)
    radial = surface.points / np.linalg.norm(surface.points, axis=1)[:, None]
    # The mesh's flat faces turn by 4 degrees from one to the next.
    assert np.einsum("ij,ij->i", radial, surface.normals).min() > np.cos(np.radians(3.0))


def test_both_faces_of_a_thin_wall_are_sampled_alike() -> None:
    surface = sample_surface(SHAPES["sheet"], SPACING)
    top, bottom = surface.normals[:, 2] > 0.9, surface.normals[:, 2] < -0.9
    assert top.sum() == pytest.approx(bottom.sum(), rel=0.05)
    assert surface.points[top][:, 2] == pytest.approx(0.5 * WALL, abs=1e-12)
    # A caller finds the other face among the neighbours.
    other = surface.normals[surface.neighbours[top]][:, :, 2] < -0.9
    assert other.any(axis=1).all()


def test_the_neighbours_are_the_nearest_samples(sampled: tuple[Mesh, Surface]) -> None:
    _, surface = sampled
    assert surface.neighbours.shape == (len(surface.points), NEIGHBOURS)
    for i in range(0, len(surface.points), 97):
        gaps = np.linalg.norm(surface.points - surface.points[i], axis=1)
        gaps[i] = np.inf
        found = gaps[surface.neighbours[i]]
        assert found == pytest.approx(np.sort(gaps)[:NEIGHBOURS], abs=1e-12)


def test_the_table_names_the_nearest_sample_of_every_voxel_within_reach() -> None:
    """Against every distance, on every voxel."""
    points = np.random.default_rng(2).uniform(-0.01, 0.01, (60, 3))
    table = voxel_table(points, 1.5e-3, 6e-3)
    centres = table.origin + (np.indices(table.nearest.shape).reshape(3, -1).T + 0.5) * table.pitch
    gaps, nearest = cKDTree(points).query(centres)
    expected = np.where(gaps < 6e-3, nearest, -1)
    np.testing.assert_array_equal(table.nearest.ravel(), expected)


def test_the_table_reaches_around_the_whole_surface(sampled: tuple[Mesh, Surface]) -> None:
    _, surface = sampled
    table = surface.table
    # A voxel belongs by its centre, which may be half its diagonal farther than the place.
    reach = table.reach - 0.5 * np.sqrt(3.0) * table.pitch
    places = surface.points[::7] + reach * surface.normals[::7]
    index = np.floor((places - table.origin) / table.pitch).astype(np.int64)
    assert (index >= 0).all()
    assert (index < table.nearest.shape).all()
    assert (table.nearest[tuple(index.T)] >= 0).all()


def test_thinning_leaves_no_two_alike_and_no_place_uncovered() -> None:
    rng = np.random.default_rng(4)
    points = rng.uniform(0.0, 0.02, (3000, 3))
    facing = np.tile([0.0, 0.0, 1.0], (3000, 1))
    facing[::2] *= -1.0
    chosen = thin(points, facing, 2e-3)
    for side in (1.0, -1.0):
        kept = points[chosen][facing[chosen][:, 2] == side]
        all_of_side = points[facing[:, 2] == side]
        assert len(cKDTree(kept).query_pairs(2e-3 * (1.0 - 1e-12))) == 0
        assert np.max(cKDTree(kept).query(all_of_side)[0]) < 2e-3


def test_half_the_spacing_is_four_times_the_samples() -> None:
    counts = [len(sample_surface(SHAPES["box"], spacing).points) for spacing in (4e-3, 2e-3)]
    assert counts[1] / counts[0] == pytest.approx(4.0, rel=0.1)


def test_random_points_are_even_over_the_area() -> None:
    """A face gets its share, however large the triangles of another."""
    mesh = SHAPES["box"]
    points, faces = random_points(mesh, 20_000, np.random.default_rng(0))
    share = np.bincount(faces, minlength=len(mesh.faces)) / 20_000
    assert share == pytest.approx(mesh.face_areas / mesh.face_areas.sum(), abs=0.012)
    top = points[points[:, 2] > 0.0149999]
    assert np.histogram2d(top[:, 0], top[:, 1], bins=4)[0].std() < 0.1 * len(top) / 16


def test_the_same_seed_gives_the_same_samples() -> None:
    one, other = (sample_surface(SHAPES["box"], SPACING, seed=5) for _ in range(2))
    np.testing.assert_array_equal(one.points, other.points)
    np.testing.assert_array_equal(one.normals, other.normals)


def test_an_object_smaller_than_its_samples_is_refused() -> None:
    with pytest.raises(MeshRefused, match=r"samples .* mm.* 32"):
        sample_surface(box(0.002, 0.002, 0.002), SPACING)


def test_a_mesh_without_area_is_refused() -> None:
    flat = Mesh(np.zeros((3, 3)), np.array([[0, 1, 2]]))
    with pytest.raises(MeshRefused, match="area"):
        sample_surface(flat, SPACING)
