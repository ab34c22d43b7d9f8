"""What networks are told of a surface: the same that rays through all faces say, for every ray."""

import numpy as np
import pytest

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.faces.ray_mesh import RayMesh
from harness.basics.mesh import Mesh
from harness.objectfile.vision.coverage.faces import FaceCubes, first_met
from harness.objectfile.vision.coverage.outline import is_closed, mesh_outline
from harness.objectfile.vision.light import LampGrid
from harness.objectfile.vision.surface import SurfaceExtras
from harness.objectfile.vision.threads import Crew, Workspace
from harness.objects.household import build
from harness.picture.pinhole import DirectionalLight, Pinhole
from harness.sim.light.appearance import plain
from harness.sim.light.lambert import irradiance, places_seen, sees_light
from tests.oracles.asked_surface import told_of
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


def rays(mesh: Mesh, count: int, seed: int) -> tuple[FloatArray, FloatArray]:
    """Rays of one eye towards anywhere in a box twice as large; a third of them along the axes."""
    random = np.random.default_rng(seed)
    low, high = mesh.bounds
    eye = 0.5 * (low + high) + random.normal(size=3) * mesh.diagonal * random.choice([0.1, 1.0, 30.0])
    toward = 0.5 * (low + high) + random.uniform(-1.0, 1.0, (count, 3)) * (high - low) - eye
    along = random.choice([-1.0, 1.0], count)[:, None] * np.eye(3)[random.integers(0, 3, count)]
    toward[::3] = along[::3]
    return eye, toward / np.linalg.norm(toward, axis=1, keepdims=True)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("name", MESHES)
def test_cubes_say_which_face_a_ray_meets_first(name: str, seed: int) -> None:
    mesh = MESHES[name]
    eye, ways = rays(mesh, 3000, seed)
    hits = RayMesh(mesh).first_hits(eye, ways)
    cubes = FaceCubes.of(mesh)
    faces, weights = np.empty(len(ways), np.int64), np.empty((len(ways), 2))
    first_met(eye, ways, np.zeros(len(ways)), np.empty(0, np.int32), cubes.lists, faces, weights)
    assert ((faces >= 0) == (hits.face >= 0)).all()
    # Of two faces that are met at once, on their edge, either is right; the place is one.
    met = faces >= 0
    found, wanted = at(mesh, faces[met], weights[met]), at(mesh, hits.face[met], hits.weights[met])
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-9 * float(np.linalg.norm(eye)) + 1e-12)
    assert np.count_nonzero(faces != hits.face) <= 0.002 * len(faces)


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
        seen = np.empty(len(starts), bool)
        grid = LampGrid.of(mesh, lamp, along)
        grid.sees(starts, exact.least, np.maximum(on, 0), np.ones(len(on)), seen)
        np.testing.assert_array_equal(seen, exact.free(starts, lamp, np.maximum(on, 0)))
        grid.sees(starts, exact.least, on, np.where(on > 2, 0.0, 1.0), seen)
        assert not seen[(on < 0) | (on > 2)].any()


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
    seen = np.empty(len(places), bool)
    grid.sees(places, 1e-9, np.full(len(places), len(mesh.faces)), np.ones(len(places)), seen)
    np.testing.assert_array_equal(seen, places[:, 0] < 0.0)


def told_by_all_faces(mesh: Mesh, eye: FloatArray, ways: FloatArray, light: FloatArray) -> AnyArray:
    """Visibility and normal as the reference's pictures have them."""
    told, look, exact = np.zeros((len(ways), 4), np.float32), plain(mesh, (1.0, 1.0, 1.0)), RayMesh(mesh)
    hits = exact.first_hits(eye, ways)
    met = np.flatnonzero(hits.face >= 0)
    places, lamp = places_seen(look, hits.face[met], hits.weights[met], ways[met]), DirectionalLight(light)
    told[met, 0] = sees_light(exact, places, lamp, irradiance(places, lamp, mesh.diagonal) > 0.0)
    told[met, 1:] = places.normals
    return told


def seen_from(mesh: Mesh, camera: Pinhole) -> tuple[FloatArray, FloatArray, AnyArray]:
    """Rays of a picture, and the depth and faces that its outline tells."""
    outline = mesh_outline(mesh, is_closed(mesh), camera, 3, Crew(1), Workspace(), True)
    (x, y), centres = camera.centre_px, outline.places.astype(np.float64)
    across = (centres - (x, y)) / camera.focal_px
    slant = 1.0 / np.sqrt((across**2).sum(axis=1) + 1.0)
    local = slant[:, None] * np.column_stack([across, np.ones(len(across))])
    ways = np.ascontiguousarray(local @ camera.object_from_camera[:3, :3].T)
    return ways, outline.depth / slant, outline.faces


@pytest.mark.parametrize("name", [pytest.param("mug", marks=pytest.mark.slow), "box", "sheet"])
@pytest.mark.parametrize("is_known", [False, True], ids=["taken for open", "known to be closed or not"])
def test_pictures_are_told_what_all_faces_say(name: str, is_known: bool) -> None:
    """From near and far, by the depth of the outline, without it, and by its faces too."""
    mesh = MESHES[name]
    told = SurfaceExtras(mesh, 4, is_known and is_closed(mesh))
    for away, light in ((1.2, (0.0, 0.6, 0.8)), (2.5, (0.48, -0.6, 0.64)), (25.0, (-0.8, -0.6, 0.0))):
        camera = looking(mesh, away, 96, 80)
        ways, depth, faces = seen_from(mesh, camera)
        exact = told_by_all_faces(mesh, camera.eye, ways, np.array(light))
        assert len(ways) > 0
        unknown, none = np.full(len(ways), np.inf), np.empty(0, np.int32)
        for known, likely in ((depth, none), (unknown, none), (depth, faces)):
            found = told_of(told, camera.eye, ways, np.array(light), known, likely)
            differ = (found != exact).any(axis=1)
            # On an edge between two faces either may be the one that is met.
            assert np.count_nonzero(differ) <= 0.001 * len(ways)
            assert (found[:, 0] != exact[:, 0]).sum() <= 0.001 * len(ways)


def test_an_eye_within_is_told_of_the_wall_around_it() -> None:
    camera = Pinhole.looking_at((0.05, 0.03, 0.01), (0.09, 0.03, 0.012), (0, 0, 1), 40, 40, 1.2)
    ways, depth, faces = seen_from(BOX, camera)
    light = np.array([0.6, 0.0, 0.8])
    told = SurfaceExtras(BOX, 4, True)
    # An eye outside before it: what is listed under the lamp is not the same.
    told_of(told, np.array([1.0, 1.0, 1.0]), ways, light, np.full(len(ways), np.inf))
    found = told_of(told, camera.eye, ways, light, depth, faces)
    np.testing.assert_array_equal(found, told_by_all_faces(BOX, camera.eye, ways, light))
    assert not found[:, 0].any()
    assert (np.einsum("nx,nx->n", found[:, 1:], ways) < 0.0).all()


@pytest.mark.parametrize("name", ["mug", "bowl"])
def test_places_lifted_from_faces_that_look_away_are_told_the_same(name: str) -> None:
    """Lamps all around, low ones too, and eyes all around: every ray is told what all faces say."""
    mesh, random = build(name), np.random.default_rng(7)
    told = SurfaceExtras(mesh, 4, is_closed(mesh))
    middle = mesh.bounds.mean(axis=0)
    differ = rays = 0
    for _ in range(6):
        light, away = random.normal(size=(2, 3))
        light, eye = light / np.linalg.norm(light), middle + 2.0 * mesh.diagonal * away / np.linalg.norm(away)
        camera = Pinhole.looking_at(eye, middle, (0, 0, 1), 120, 120, 0.5)
        ways, depth, faces = seen_from(mesh, camera)
        exact = told_by_all_faces(mesh, camera.eye, ways, light)
        found = told_of(told, camera.eye, ways, light, depth, faces)
        differ += int(np.count_nonzero(found[:, 0] != exact[:, 0]))
        rays += len(ways)
    # On an edge between two faces either may be the one that is met.
    assert rays > 10_000
    assert differ <= 1


def test_who_meets_nothing_and_who_asks_nothing_is_told_nothing() -> None:
    away = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    eye, light = np.array([0.5, 0.5, 0.5]), np.array([0.0, 0.0, 1.0])
    nowhere = np.full(2, np.inf)
    assert not told_of(SurfaceExtras(BOX, 4), eye, away, light, nowhere).any()
    assert SurfaceExtras(BOX, 0).under(eye, light) is None
    assert told_of(SurfaceExtras(BOX, 4), eye, away[:0], light, nowhere[:0]).shape == (0, 4)
