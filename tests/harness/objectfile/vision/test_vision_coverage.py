"""Which pixels a mesh covers: rays through the same places say so too."""

from dataclasses import replace

import numpy as np
import pytest

from harness.basics.arrays import AnyArray
from harness.basics.faces.ray_mesh import RayMesh
from harness.basics.mesh import Mesh
from harness.objectfile.vision.coverage import Contours, Outline, centre_out, is_closed, mesh_outline
from harness.objects.household import build
from harness.picture.pinhole import Pinhole
from tests.oracles.plain_look import looking
from tests.oracles.seen_shapes import cuboid, square

MUG = build("mug", 8e-3)
INSIDE = np.array([0.01, 0.013, 0.021])


def outline_of(mesh: Mesh, camera: Pinhole, side: int, closed: bool) -> Outline:
    """By a mesh that is closed, or taken for open."""
    contours = Contours.of(mesh)
    return mesh_outline(replace(contours, closed=closed and contours.closed), camera, side)


def outlined(mesh: Mesh, camera: Pinhole, side: int, closed: bool = False) -> tuple[AnyArray, AnyArray]:
    """Cover and depth of every pixel."""
    found = outline_of(mesh, camera, side, closed)
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
    found = outline_of(mesh, camera, side, False)
    met = RayMesh(mesh).first_hits(camera.eye, camera.directions_at(found.places.astype(np.float64))).face
    assert (met >= 0).all()
    partly = (found.cover > 0.0) & (found.cover < 1.0)
    assert partly.any()
    middle = np.stack([found.pixels % 41 + 0.5, found.pixels // 41 + 0.5], axis=1)
    assert np.abs(found.places - middle).max() <= 0.5
    np.testing.assert_allclose(found.places[~partly], middle[~partly], atol=1e-5)


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
def test_going_around_says_what_a_ray_through_every_sub_pixel_says(mesh: Mesh, side: int) -> None:
    """Pixels, cover, places, depth and faces; on an edge either of two sub-pixels or faces is right."""
    closed, middle = is_closed(mesh), mesh.bounds.mean(axis=0)
    # Far, near, and within the object, of which a part is behind the camera.
    for away, width in ((np.array([0.4, 0.5, 0.3]), 90), (np.array([0.0, 0.1, 2.0]), 31), (INSIDE, 33)):
        camera = Pinhole.looking_at(middle + away, middle, (0, 1, 0), width, 40, 12.0 / (width + 40))
        one, other = outline_of(mesh, camera, side, closed), _by_rays(mesh, camera, side)
        assert len(one.pixels) > 50
        assert len(np.setxor1d(one.pixels, other.pixels)) <= 2
        _, a, b = np.intersect1d(one.pixels, other.pixels, return_indices=True)
        assert np.count_nonzero(one.cover[a] != other.cover[b]) <= 2
        same = (one.places[a] == other.places[b]).all(axis=1)
        assert np.count_nonzero(~same) <= 2
        np.testing.assert_allclose(one.depth[a][same], other.depth[b][same], rtol=3e-6)
        assert np.count_nonzero(one.faces[a] != other.faces[b]) <= 0.005 * len(a) + 2


def _by_rays(mesh: Mesh, camera: Pinhole, side: int) -> Outline:
    fine = camera.resized(side * camera.width, side * camera.height)
    ways = fine.directions().reshape(-1, 3)
    hits = RayMesh(mesh).first_hits(camera.eye, ways)

    def by_pixel(values: AnyArray) -> AnyArray:
        blocks = values.reshape(camera.height, side, camera.width, side).swapaxes(1, 2)
        return blocks.reshape(-1, side, side)[:, *centre_out(side).T]

    met, depth = by_pixel(hits.face >= 0), by_pixel(hits.distance * (ways @ camera.forward))
    pixels = np.flatnonzero(met.any(axis=1))
    at = met[pixels].argmax(axis=1)
    i, j = np.divmod(pixels, camera.width)
    places = np.stack([j, i], axis=1) + 0.5 + (centre_out(side)[at][:, ::-1] - side // 2) / side
    cover = met[pixels].mean(axis=1).astype(np.float32)
    faces = by_pixel(hits.face)[pixels, at].astype(np.int32)
    return Outline(pixels, cover, places.astype(np.float32), depth[pixels, at].astype(np.float32), faces)


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
