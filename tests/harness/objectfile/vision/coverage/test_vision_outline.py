"""Which pixels a mesh covers: rays through the same places say so too."""

import numpy as np
import pytest

from harness.basics.arrays import AnyArray
from harness.basics.faces.ray_mesh import RayMesh
from harness.basics.mesh import Mesh
from harness.objectfile.vision.coverage.outline import centre_out, drawn_outline, is_closed, mesh_outline
from harness.objectfile.vision.threads import Crew, Workspace
from harness.objects.household import build
from harness.picture.pinhole import Pinhole
from tests.oracles.plain_look import looking
from tests.oracles.seen_shapes import cuboid, square

MUG = build("mug", 8e-3)


def outlined(mesh: Mesh, camera: Pinhole, side: int, closed: bool = False) -> tuple[AnyArray, AnyArray]:
    """Cover and depth of every pixel."""
    found = mesh_outline(mesh, closed, camera, side, Crew(1), Workspace())
    cover, depth = np.zeros(camera.pixels), np.zeros(camera.pixels)
    cover[found.pixels], depth[found.pixels] = found.cover, found.depth
    return cover, depth


def inside_the_mug() -> Pinhole:
    low, high = MUG.bounds
    eye = 0.5 * (low + high) - np.array([0.0167, 0.0, 0.0])
    return Pinhole.looking_at(eye, eye + np.array([0.02, 0.05, -0.03]), (0, 0, 1), 40, 30, np.radians(100.0))


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("view", ["near", "far", "wide", "inside"])
def test_centres_are_covered_where_rays_meet_the_mesh(view: str, closed: bool) -> None:
    cameras = {
        "near": looking(MUG, 1.2, 64),
        "far": looking(MUG, 25.0, 160),
        "wide": looking(MUG, 2.0, 80, 31),
        "inside": inside_the_mug(),
    }
    camera = cameras[view]
    cover, depth = outlined(MUG, camera, 1, closed)
    ways = camera.directions().reshape(-1, 3)
    away = RayMesh(MUG).first_hits(camera.eye, ways).distance
    met = np.isfinite(away)
    assert met.sum() > 0
    # A ray along an edge of the outline may be met by one and missed by the other.
    assert np.count_nonzero(met != (cover > 0.0)) <= 1
    both = met & (cover > 0.0)
    exact = away[both] * (ways[both] @ camera.forward)
    np.testing.assert_allclose(depth[both], exact, rtol=3e-6)


@pytest.mark.parametrize("side", [1, 3, 5, 7])
def test_cover_of_a_square_is_its_area(side: int) -> None:
    mesh = square(0.1)
    eye = np.array([0.003, -0.002, 0.4])
    camera = Pinhole.looking_at(eye, eye - [0, 0, 1.0], (0, 1, 0), 50, 40, np.radians(30.0))
    cover, depth = outlined(mesh, camera, side)
    edge = 0.1 / 0.4 * camera.focal_px
    # Along each border a sub-pixel is in or out.
    assert abs(cover.sum() - edge**2) <= 2.0 * edge / side
    assert depth[cover > 0.0] == pytest.approx(0.4, rel=1e-6)


def test_a_pixel_half_covered_looks_where_it_is() -> None:
    mesh, side = square(0.1), 5
    camera = Pinhole.looking_at((0, 0, 0.4), (0, 0, 0), (0, 1, 0), 41, 41, np.radians(31.0))
    found = mesh_outline(mesh, False, camera, side, Crew(1), Workspace())
    met = RayMesh(mesh).first_hits(camera.eye, camera.directions_at(found.places.astype(np.float64))).face
    assert (met >= 0).all()
    partly = (found.cover > 0.0) & (found.cover < 1.0)
    assert partly.any()
    middle = np.stack([found.pixels % 41 + 0.5, found.pixels // 41 + 0.5], axis=1)
    assert np.abs(found.places - middle).max() <= 0.5
    np.testing.assert_allclose(found.places[~partly], middle[~partly], atol=1e-5)


@pytest.mark.parametrize("closed", [False, True])
def test_more_threads_see_what_one_sees(closed: bool) -> None:
    """Each draws some of the faces: twice the same mesh, so that every place is as near in two of them."""
    twice = Mesh(MUG.vertices, np.concatenate([MUG.faces, MUG.faces]))
    camera = looking(MUG, 1.5, 33, 47)
    for mesh in (MUG, twice):
        one, *more = (mesh_outline(mesh, closed, camera, 3, Crew(n), Workspace(), True) for n in (1, 2, 3))
        assert (one.faces < len(MUG.faces)).all()
        for found in more:
            for kind in ("pixels", "cover", "places", "depth", "faces"):
                np.testing.assert_array_equal(getattr(one, kind), getattr(found, kind))


def soup() -> Mesh:
    """Faces that share corners and edges as it happens, some of no area."""
    random = np.random.default_rng(0)
    return Mesh(0.05 * random.normal(size=(40, 3)), random.integers(0, 40, (60, 3)))


def turned_about() -> Mesh:
    """A mug without its rim, every third of its faces the other way around."""
    kept = MUG.faces[MUG.corners[:, :, 2].max(axis=1) < 0.8 * MUG.bounds[1, 2]].copy()
    kept[::3] = kept[::3, ::-1]
    return Mesh(MUG.vertices, kept)


@pytest.mark.parametrize("side", [1, 3, 7])
@pytest.mark.parametrize(
    "mesh", [MUG, turned_about(), soup(), square(0.1)], ids=["mug", "open", "soup", "square"]
)
def test_going_around_says_what_every_face_drawn_says(mesh: Mesh, side: int) -> None:
    """Pixels, cover, places, depth and faces; on an edge either of two sub-pixels or faces is right."""
    closed, middle = is_closed(mesh), mesh.bounds.mean(axis=0)
    for away, width in ((np.array([0.4, 0.5, 0.3]), 90), (np.array([0.0, 0.1, 2.0]), 31)):
        camera = Pinhole.looking_at(middle + away, middle, (0, 1, 0), width, 40, 12.0 / (width + 40))
        one = mesh_outline(mesh, closed, camera, side, Crew(1), Workspace(), True)
        other = drawn_outline(mesh, closed, camera, side, Crew(1), Workspace(), True)
        assert len(one.pixels) > 50
        assert len(np.setxor1d(one.pixels, other.pixels)) <= 1
        _, a, b = np.intersect1d(one.pixels, other.pixels, return_indices=True)
        assert np.count_nonzero(one.cover[a] != other.cover[b]) <= 2
        same = (one.places[a] == other.places[b]).all(axis=1)
        assert np.count_nonzero(~same) <= 2
        np.testing.assert_allclose(one.depth[a][same], other.depth[b][same], rtol=3e-6)
        assert np.count_nonzero(one.faces[a] != other.faces[b]) <= 0.005 * len(a) + 2


def test_what_is_behind_the_camera_is_not_seen() -> None:
    mesh = cuboid(0.1, 0.1, 0.1)
    camera = Pinhole.looking_at((0, 0, 0.2), (0, 0, 1.0), (0, 1, 0), 20, 20, np.radians(60.0))
    cover, _ = outlined(mesh, camera, 3)
    assert not cover.any()


def test_closed_surfaces_are_told_from_open_ones() -> None:
    assert is_closed(cuboid(0.1, 0.2, 0.3))
    assert is_closed(MUG)
    assert not is_closed(square(0.1))
    box = cuboid(0.1, 0.1, 0.1)
    assert not is_closed(Mesh(box.vertices, box.faces[:, ::-1]))
    assert not is_closed(Mesh(box.vertices, box.faces[1:]))


def test_sub_pixels_are_counted_from_the_centre() -> None:
    places = centre_out(5)
    assert places[0].tolist() == [2, 2]
    away = np.linalg.norm(places - 2, axis=1)
    assert (np.diff(away) >= 0.0).all()
    assert len(np.unique(places, axis=0)) == 25
