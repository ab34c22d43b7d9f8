"""Where rays meet a surface: the same that rays through all faces say, for every ray."""

from dataclasses import replace

import numpy as np
import pytest

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.faces.ray_mesh import RayMesh
from harness.basics.mesh import Mesh
from harness.objectfile.vision.coverage import Contours, mesh_outline
from harness.objectfile.vision.hit import HitSurface, LampGrid, SurfacePoints
from harness.objects.household import build
from harness.picture.pinhole import DirectionalLight, Pinhole
from harness.sim.light.appearance import plain
from harness.sim.light.direct_image import irradiance, sees_light
from harness.sim.light.lambert import places_seen
from tests.oracles.plain_look import looking

MUG = build("mug")
CORNERS = np.array([[x, y, z] for x in (0.0, 0.1) for y in (0.0, 0.06) for z in (0.0, 0.02)])
BOX = Mesh(
    CORNERS,
    np.array([[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6],
              [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]),
)  # fmt: skip
SHEET = Mesh(np.array([[0.0, 0.0, 0.0], [0.2, 0.0, 0.0], [0.2, 0.1, 0.0], [0.0, 0.1, 0.0]]),
             np.array([[0, 1, 2], [0, 2, 3]]))  # fmt: skip
THIN = Mesh(np.vstack([CORNERS, CORNERS[:1] + 0.05]), np.vstack([BOX.faces, [[8, 8, 8]]]))
"""A box with a face that is a point."""
MESHES = {"mug": MUG, "box": BOX, "sheet": SHEET, "a face without area": THIN}


def at(mesh: Mesh, faces: AnyArray, weights: FloatArray) -> FloatArray:
    """``(n, 3)`` places of faces."""
    shares = np.column_stack([1.0 - weights.sum(axis=1), weights])
    return np.asarray(np.einsum("nc,ncx->nx", shares, mesh.corners[faces]))


@pytest.mark.parametrize("along", [1, 5, 128])
@pytest.mark.parametrize("name", MESHES)
def test_cells_of_any_size_say_what_a_lamp_sees(name: str, along: int) -> None:
    mesh, random = MESHES[name], np.random.default_rng(1)
    exact = RayMesh(mesh)
    low, high = mesh.bounds
    starts = np.ascontiguousarray(random.uniform(low, high, (2000, 3)))
    on = np.full(len(starts), -1)
    on[::2] = random.integers(0, len(mesh.faces), len(on[::2]))
    starts[::2] = at(mesh, on[::2], random.dirichlet(np.ones(3), len(on[::2]))[:, :2])
    for lamp in (np.array([0.0, 0.0, 1.0]), np.array([0.48, -0.6, 0.64]), np.array([-1.0, 0.0, 0.0])):
        grid = LampGrid.of(mesh, lamp, along)
        seen = grid.sees(starts, exact.least, np.maximum(on, 0), np.ones(len(on)))
        np.testing.assert_array_equal(seen, exact.free(starts, lamp, np.maximum(on, 0)))
        assert not grid.sees(starts, exact.least, on, np.where(on > 2, 0.0, 1.0))[on > 2].any()


def test_slivers_are_not_listed_everywhere() -> None:
    """A disc of 20 000 faces that all meet in its middle, and a lid above half of it."""
    turn = np.linspace(0.0, 2.0 * np.pi, 20_001)
    rim = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(len(turn))])
    lid = np.array([[0.0, -1.0, 0.1], [1.0, -1.0, 0.1], [1.0, 1.0, 0.1], [0.0, 1.0, 0.1]])
    count = len(rim)
    fan = np.column_stack([np.arange(count - 1), np.arange(1, count), np.full(count - 1, count)])
    lids = count + 1 + np.array([[0, 1, 2], [0, 2, 3]])
    mesh = Mesh(np.vstack([rim, [[0.0, 0.0, 0.0]], lid]), np.vstack([fan, lids]))
    grid = LampGrid.of(mesh, np.array([0.0, 0.0, 1.0]))
    assert len(grid.listed) <= 32 * len(mesh.faces)
    places = np.random.default_rng(3).uniform((-0.9, -0.4, 0.0), (0.9, 0.4, 0.0), (500, 3))
    seen = grid.sees(places, 1e-9, np.full(len(places), len(mesh.faces)), np.ones(len(places)))
    np.testing.assert_array_equal(seen, places[:, 0] < 0.0)


def by_all_faces(
    mesh: Mesh, camera: Pinhole, light: FloatArray, contours: Contours
) -> tuple[FloatArray, AnyArray]:
    """Points, visibility and normals as the reference's pictures have them, along the same rays."""
    eye = camera.eye
    ways = camera.directions_at(mesh_outline(contours, camera, 3).places.astype(np.float64))
    extras, look, exact = np.zeros((len(ways), 4), np.float32), plain(mesh, (1.0, 1.0, 1.0)), RayMesh(mesh)
    hits = exact.first_hits(eye, ways)
    met = np.flatnonzero(hits.face >= 0)
    places, lamp = places_seen(look, hits.face[met], hits.weights[met], ways[met]), DirectionalLight(light)
    extras[met, 0] = sees_light(exact, places, lamp, irradiance(places, lamp, mesh.diagonal) > 0.0)
    extras[met, 1:] = places.normals
    return eye + hits.distance[:, None] * ways, extras


def seen_of(surface: HitSurface, contours: Contours, camera: Pinhole, light: FloatArray) -> SurfacePoints:
    """The points that a picture shows."""
    return surface.points(camera, DirectionalLight(light), mesh_outline(contours, camera, 3))


@pytest.mark.parametrize("name", [pytest.param("mug", marks=pytest.mark.slow), "box", "sheet"])
@pytest.mark.parametrize("is_known", [False, True], ids=["taken for open", "known to be closed or not"])
def test_pictures_show_what_all_faces_say(name: str, is_known: bool) -> None:
    """From near and far."""
    mesh = MESHES[name]
    contours = Contours.of(mesh)
    contours = replace(contours, closed=is_known and contours.closed)
    surface = HitSurface(contours)
    for away, light in ((1.2, (0.0, 0.6, 0.8)), (2.5, (0.48, -0.6, 0.64)), (25.0, (-0.8, -0.6, 0.0))):
        camera = looking(mesh, away, 96, 80)
        found = seen_of(surface, contours, camera, np.array(light))
        points, extras = by_all_faces(mesh, camera, np.array(light), contours)
        assert len(points) > 0
        # On an edge between two faces either may be the one that is met.
        np.testing.assert_allclose(found.points, points, rtol=0, atol=1e-9 * away * mesh.diagonal)
        differ = (np.abs(found.extras - extras) > 1e-6).any(axis=1)
        assert np.count_nonzero(differ) <= 0.001 * len(points)


def test_an_eye_within_sees_the_wall_around_it() -> None:
    camera = Pinhole.looking_at((0.05, 0.03, 0.01), (0.09, 0.03, 0.012), (0, 0, 1), 40, 40, 1.2)
    light, contours = np.array([0.6, 0.0, 0.8]), Contours.of(BOX)
    surface = HitSurface(contours)
    # An eye outside before it: what is listed under the lamp is not the same.
    seen_of(surface, contours, looking(BOX, 3.0, 20), light)
    found = seen_of(surface, contours, camera, light)
    points, extras = by_all_faces(BOX, camera, light, contours)
    assert len(points) == camera.pixels
    np.testing.assert_allclose(found.points, points, atol=1e-8)
    assert not found.extras[:, 0].any()
    assert not extras[:, 0].any()
    assert (np.einsum("nx,nx->n", found.extras[:, 1:], found.views) < 0.0).all()


@pytest.mark.parametrize("name", ["mug", "bowl"])
def test_points_lifted_from_faces_that_look_away_see_the_same(name: str) -> None:
    """Lamps all around, low ones too, and eyes all around: every ray is told what all faces say."""
    mesh, random = build(name), np.random.default_rng(7)
    contours = Contours.of(mesh)
    surface, middle = HitSurface(contours), mesh.bounds.mean(axis=0)
    differ = rays = 0
    for _ in range(6):
        light, away = random.normal(size=(2, 3))
        light, eye = light / np.linalg.norm(light), middle + 2.0 * mesh.diagonal * away / np.linalg.norm(away)
        camera = Pinhole.looking_at(eye, middle, (0, 0, 1), 120, 120, 0.5)
        found = seen_of(surface, contours, camera, light)
        _, extras = by_all_faces(mesh, camera, light, contours)
        differ += int(np.count_nonzero(found.extras[:, 0] != extras[:, 0]))
        rays += len(extras)
    # On an edge between two faces either may be the one that is met.
    assert rays > 10_000
    assert differ <= 1


def test_who_sees_nothing_has_no_points() -> None:
    contours = Contours.of(BOX)
    away = Pinhole.looking_at((0.05, 0.03, 0.5), (0.05, 0.03, 1.0), (0, 1, 0), 8, 8, 0.5)
    found = seen_of(HitSurface(contours), contours, away, np.array([0.0, 0.0, 1.0]))
    assert (found.points.shape, found.views.shape, found.extras.shape) == ((0, 3), (0, 3), (0, 4))
