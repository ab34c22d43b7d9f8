import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from harness.basics.errors import WrongUse
from harness.basics.mesh import Mesh
from harness.objects.household import MATERIALS, build

EDGES = (3e-3, 2.2e-3)
WALLS = {"mug": 3.4e-3, "bowl": 3.0e-3, "plate": 3.2e-3, "pitcher": 3.0e-3, "tray": 5.5e-3}


def as_trimesh(mesh: Mesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)


@pytest.mark.parametrize("edge", [EDGES[0], pytest.param(0.7e-3, marks=pytest.mark.slow), 9.7e-3])
@pytest.mark.parametrize("name", MATERIALS)
def test_a_built_object_is_one_closed_outward_solid_on_the_table(name: str, edge: float) -> None:
    mesh = build(name, edge)
    solid = as_trimesh(mesh)
    assert solid.is_watertight
    assert solid.is_winding_consistent
    assert solid.body_count == 1
    assert solid.volume > 0.0
    assert mesh.face_areas.min() > 0.0
    assert mesh.bounds[0, 2] == 0.0
    assert 0.10 - 6e-3 <= (mesh.bounds[1] - mesh.bounds[0]).max() <= 0.30
    assert np.abs(mesh.bounds[:, :2].mean(axis=0)).max() < 0.02


@pytest.mark.parametrize(("name", "handles"), [("mug", 1), ("pitcher", 1), ("wrench", 1), ("bowl", 0)])
def test_handles_and_rings_are_holes_one_can_reach_through(name: str, handles: int) -> None:
    assert as_trimesh(build(name)).euler_number == 2 - 2 * handles


@pytest.mark.parametrize("name", MATERIALS)
def test_two_tessellations_are_one_shape_without_a_common_vertex(name: str) -> None:
    coarse, fine = build(name, EDGES[0]), build(name, EDGES[1])
    apart = np.asarray(cKDTree(coarse.vertices).query(fine.vertices)[0])
    assert np.count_nonzero(apart < 1e-6) < 1e-3 * len(apart)
    nearest = trimesh.proximity.closest_point
    off = nearest(as_trimesh(coarse), fine.vertices[::51])[1]  # type: ignore[no-untyped-call]
    # Twice the sagitta of a 4.5 mm chord on the tightest fillet that is not subdivided by its turn.
    assert off.max() < 0.25e-3
    assert as_trimesh(fine).volume == pytest.approx(as_trimesh(coarse).volume, rel=2e-3)


@pytest.mark.parametrize(("name", "thinnest"), WALLS.items())
def test_walls_have_the_thickness_of_the_real_thing(name: str, thinnest: float) -> None:
    mesh = build(name)
    solid = as_trimesh(mesh)
    faces = np.random.default_rng(3).choice(len(mesh.faces), 100, p=mesh.face_areas / mesh.face_areas.sum())
    inward = -mesh.face_normals[faces]
    centres = mesh.corners[faces].mean(axis=1)
    hits, rays, _ = solid.ray.intersects_location(centres + 1e-5 * inward, inward, multiple_hits=False)
    thickness = np.linalg.norm(hits - centres[rays], axis=1)
    assert len(hits) == len(faces)
    # Rounded rims are thinner where a ray leaves through the rounding.
    assert np.percentile(thickness, 5) > 0.8 * thinnest
    assert np.median(thickness) == pytest.approx(thinnest, abs=3e-3)


@pytest.mark.parametrize("name", ["mug", "bowl", "pitcher", "tray"])
def test_a_vessel_holds_water(name: str) -> None:
    mesh = build(name)
    solid = as_trimesh(mesh)
    height = mesh.bounds[1, 2]
    inside = np.array([[0.0, 0.0, 0.55 * height]])
    assert not solid.contains(inside)[0]
    assert solid.convex_hull.contains(inside)[0]
    both = np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]])
    met = solid.ray.intersects_any(np.repeat(inside, 2, axis=0), both)  # type: ignore[no-untyped-call]
    assert met.tolist() == [True, False]


@pytest.mark.parametrize("name", ["mug", "pitcher"])
def test_a_handle_does_not_come_through_the_wall(name: str) -> None:
    x, y, z = build(name).vertices.T
    upper = (z > 0.015) & (z < 0.75 * z.max())
    radius, height = np.hypot(x, y)[upper], z[upper]
    by_handle = np.abs(np.arctan2(y, x))[upper] < 0.6
    for low in np.arange(0.015, 0.7 * z.max(), 0.005):
        band = (height >= low) & (height < low + 0.005)
        here, elsewhere = radius[band & by_handle].min(), radius[band & ~by_handle].min()
        # The wall itself leans by less than this over a band.
        assert here > elsewhere - 0.4e-3


def test_the_same_edge_gives_the_same_mesh() -> None:
    first, second = build("pitcher"), build("pitcher")
    assert np.array_equal(first.vertices, second.vertices)
    assert np.array_equal(first.faces, second.faces)


def test_an_unknown_object_is_refused_with_the_names_there_are() -> None:
    with pytest.raises(WrongUse, match="mug, bowl, plate, pitcher, tray, wrench"):
        build("teacup")


@pytest.mark.parametrize("edge", [0.0, 1e-4, 0.5, float("nan")])
def test_an_edge_out_of_range_is_refused(edge: float) -> None:
    with pytest.raises(WrongUse, match=r"0\.3 to 10 mm"):
        build("mug", edge)
