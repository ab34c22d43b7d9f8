"""Pictures from networks whose look is known, and laws that any picture keeps."""

from dataclasses import replace

import numpy as np
import pytest

from harness.authoring.vision.surface_cells import surface_cells
from harness.basics.errors import DataRefused, WrongUse
from harness.basics.faces.ray_mesh import RayMesh
from harness.basics.mesh import Mesh
from harness.objectfile.vision.graph import VisionNetworks
from harness.objectfile.vision.network import COMPACT, PER_CELL, VisionGrid, VisionModel, VisionWeights
from harness.objectfile.vision.render import RenderSettings, VisionRenderer
from harness.objects.household import build
from harness.picture.pinhole import DirectionalLight, Pinhole
from tests.oracles.plain_look import even_look, file_of, looking, shadow_look, sloped_look
from tests.oracles.plain_networks import Query, evaluate
from tests.oracles.seen_shapes import cuboid, square, together
from tests.samples.fitted_look import fitted_look

LIGHT = DirectionalLight(np.array([0.3, -0.4, 0.8]))
BOX = cuboid(0.1, 0.08, 0.06)
MUG = build("mug", 8e-3)


@pytest.fixture(scope="module")
def model() -> VisionModel:
    """Solved for, not trained: see ``fitted_look``."""
    return fitted_look(MUG, COMPACT, cells=8, samples=300)


@pytest.fixture(scope="module")
def mug(model: VisionModel) -> VisionRenderer:
    return VisionRenderer(file_of(model), MUG, threads=2)


def test_cells_meet_without_a_seam() -> None:
    """A colour that is linear across cells, on a flat face that many of them hold a part of."""
    mesh = cuboid(0.1, 0.1, 0.1)
    grid = surface_cells(mesh, 4)
    renderer = VisionRenderer(file_of(sloped_look(grid, 2, 1.5, 1e6)), mesh, 1)
    camera = Pinhole.looking_at((0.0, 0.0, 0.5), (0, 0, 0), (0, 1, 0), 60, 60, np.radians(8.0))
    image = renderer.render(camera, LIGHT).image
    assert (image.alpha == 1.0).all()
    np.testing.assert_allclose(image.depth, 0.45, rtol=1e-6)
    red, ways = image.colour[..., 0], camera.directions()
    y = (image.depth / (ways @ camera.forward))[..., None] * ways
    assert np.ptp(red) > 0.05
    share = (y[..., 0] - grid.low[0]) / grid.cell
    np.testing.assert_allclose(red, 1.0 / (1.0 + np.exp(-0.25 * share)), atol=2e-4)


def test_a_pixel_is_what_the_networks_answer_where_its_ray_meets_the_mesh(
    model: VisionModel, mug: VisionRenderer
) -> None:
    """Against the layers in plain float64, at the hits of rays through all faces."""
    camera = looking(MUG, 2.0, 48, 40)
    image = mug.render(camera, LIGHT, RenderSettings(coverage=1)).image
    ways = camera.directions().reshape(-1, 3)
    away = RayMesh(MUG).first_hits(camera.eye, ways).distance
    met = np.flatnonzero(np.isfinite(away) & (image.alpha.ravel() > 0.0))
    assert len(met) > 300
    points = camera.eye + away[met, None] * ways[met]
    networks = mug.networks.grid.networks(points)
    assert (networks >= 0).all()
    _, colour = evaluate(model, Query(networks, points, ways[met], LIGHT.direction, np.empty((len(met), 0))))
    apart = np.abs(image.colour.reshape(-1, 3)[met] - colour).max(axis=1)
    # Rounding may put a point on a border into the other of two cells, whose networks were solved apart.
    assert np.count_nonzero(apart > 1e-3) <= 0.01 * len(met)
    np.testing.assert_allclose(image.depth.ravel()[met], away[met] * (ways[met] @ camera.forward), rtol=3e-6)


def test_how_the_work_is_shared_changes_nothing(model: VisionModel, mug: VisionRenderer) -> None:
    camera = looking(MUG, 2.0, 40)
    first = mug.render(camera, LIGHT)
    again = VisionRenderer(file_of(model, block=5), MUG, threads=1).render(camera, LIGHT)
    np.testing.assert_allclose(again.image.colour, first.image.colour, atol=1e-5)
    np.testing.assert_array_equal(again.image.alpha, first.image.alpha)


def test_the_outline_is_the_meshes_to_a_pixel(mug: VisionRenderer) -> None:
    camera = looking(MUG, 1.6, 72)
    met = np.isfinite(RayMesh(MUG).first_hits(camera.eye, camera.directions().reshape(-1, 3)).distance)
    met = met.reshape(72, 72)
    near = np.zeros_like(met)
    far = np.ones_like(met)
    padded = np.pad(met, 1)
    for i in range(3):
        for j in range(3):
            near |= padded[i : i + 72, j : j + 72]
            far &= padded[i : i + 72, j : j + 72]
    alpha = mug.render(camera, LIGHT).image.alpha
    assert not (alpha[~near] > 0.0).any()
    assert (alpha[far] > 0.5).mean() > 0.995


def test_metres_are_metres(mug: VisionRenderer) -> None:
    """Twice as far is half as large, and the depth says how far."""
    near, far = (mug.render(looking(MUG, d, 96), LIGHT).image for d in (3.0, 6.0))
    assert near.alpha.sum() / far.alpha.sum() == pytest.approx(4.0, rel=0.08)
    longest = float(np.ptp(MUG.bounds, axis=0).max())
    for image, away in ((near, 3.0), (far, 6.0)):
        assert image.depth[image.alpha > 0].mean() == pytest.approx(away * longest, abs=0.5 * longest)


def test_moving_object_camera_and_light_together_changes_nothing(
    model: VisionModel, mug: VisionRenderer
) -> None:
    shift = np.array([0.25, -0.5, 0.125])
    grid = VisionGrid(model.grid.low + shift, model.grid.cell, model.grid.cells)
    moved = VisionRenderer(
        file_of(VisionModel(grid, model.weights)), Mesh(MUG.vertices + shift, MUG.faces), 1
    )
    camera = looking(MUG, 2.0, 32)
    pose = camera.object_from_camera.copy()
    pose[:3, 3] += shift
    there = Pinhole(camera.width, camera.height, camera.focal_px, camera.centre_px, pose)
    settings = RenderSettings(coverage=1)
    a, b = mug.render(camera, LIGHT, settings).image, moved.render(there, LIGHT, settings).image
    # Rounding may put a point on the other side of a cell's border.
    assert np.mean(np.abs(a.colour - b.colour).max(axis=2) > 1e-3) < 0.01


def test_rays_within_a_pixel_are_the_mean_of_smaller_pixels(mug: VisionRenderer) -> None:
    camera = looking(MUG, 2.0, 20, 14)
    fine = mug.render(camera.resized(40, 28), LIGHT)
    found = mug.render(camera, LIGHT, RenderSettings(rays=2))
    means = fine.image.colour.reshape(14, 2, 20, 2, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(found.image.colour, means, rtol=1e-12, atol=1e-15)
    assert (found.samples, found.rays) == (fine.samples, fine.rays)
    single = mug.render(camera, LIGHT).image
    both = (found.image.alpha > 0.0) & (single.alpha > 0.0)
    assert np.median(np.abs(found.image.depth[both] - single.depth[both])) < mug.networks.grid.cell / PER_CELL


def test_light_is_linear(mug: VisionRenderer) -> None:
    camera = looking(MUG, 2.0, 32)
    one = mug.render(camera, LIGHT).image
    twice = mug.render(camera, DirectionalLight(LIGHT.direction, 2.0 * LIGHT.irradiance)).image
    none = mug.render(camera, DirectionalLight(LIGHT.direction, 0.0)).image
    longer = mug.render(camera, DirectionalLight(50.0 * LIGHT.direction)).image
    np.testing.assert_allclose(twice.colour, 2.0 * one.colour, rtol=1e-12)
    assert not none.colour.any()
    np.testing.assert_array_equal(none.alpha, one.alpha)
    np.testing.assert_allclose(longer.colour, one.colour, atol=1e-6)
    other = mug.render(camera, DirectionalLight(-LIGHT.direction)).image
    assert np.abs(other.colour - one.colour).max() > 0.1
    np.testing.assert_array_equal(mug.render(camera, LIGHT).image.colour, one.colour)


def test_shadows_fall_where_networks_are_told() -> None:
    lid = square(0.03, 0.05)
    mesh = together(square(0.1), lid)
    grid = surface_cells(mesh, 8)
    renderer = VisionRenderer(file_of(shadow_look(grid, 1e6)), mesh, 1)
    camera = Pinhole.looking_at((0.2, 0, 0.3), (0.05, 0, 0), (0, 0, 1), 60, 60, np.radians(25.0))
    light = DirectionalLight(np.array([-1.0, 0.0, 1.0]))
    image = renderer.render(camera, light).image
    ways = camera.directions().reshape(-1, 3)
    hits = RayMesh(mesh).first_hits(camera.eye, ways)
    points = camera.eye + hits.distance[:, None] * ways
    floor = np.isfinite(hits.distance) & (np.abs(points[:, 2]) < 1e-6)
    # The lid's shadow lies 50 mm further along x.
    dark = (np.abs(points[:, 0] - 0.05) < 0.014) & (np.abs(points[:, 1]) < 0.014) & (points[:, 0] < 0.0499)
    bright = (np.abs(points[:, 0] - 0.05) > 0.016) | (np.abs(points[:, 1]) > 0.016)
    red = image.colour[..., 0].ravel() / np.maximum(image.alpha.ravel(), 1e-9)
    full = image.alpha.ravel() > 0.999
    assert (floor & dark & full).sum() > 5
    assert red[floor & dark & full].max() < 0.01
    assert red[floor & bright & full].min() > 0.99


def test_settings_that_make_no_sense_are_refused() -> None:
    for wrong in ({"coverage": 2}, {"rays": 0}, {"rays": 9}):
        with pytest.raises(WrongUse):
            replace(RenderSettings(), **wrong)
    with pytest.raises(WrongUse):
        VisionRenderer(file_of(even_look(surface_cells(BOX, 4), 1.0, (0, 0, 0))), BOX, threads=0)


def test_networks_of_another_object_are_refused() -> None:
    with pytest.raises(DataRefused, match=r"\d%.* mm"):
        VisionRenderer(file_of(even_look(surface_cells(BOX, 4), 1.0, (0, 0, 0))), MUG, 1)


def test_seconds_and_samples_are_told(mug: VisionRenderer) -> None:
    found = mug.render(looking(MUG, 2.0, 32), LIGHT)
    parts = sum(value for name, value in found.seconds.items() if name != "render")
    assert 0.0 < parts <= found.seconds["render"] * (1.0 + 1e-9)
    assert found.samples == found.rays > 0


def test_points_without_a_network_are_clear(model: VisionModel, mug: VisionRenderer) -> None:
    """A few cells have lost theirs, as where a mesh was written in float32."""
    kept = np.delete(np.arange(len(model.grid)), 7)
    grid = VisionGrid(model.grid.low, model.grid.cell, model.grid.cells[kept])
    weights = {name: array[kept] for name, array in model.weights.arrays()}
    fewer = VisionWeights(model.weights.size, model.weights.density_scale, **weights)
    networks = VisionNetworks(file_of(VisionModel(grid, fewer)))
    points = np.concatenate([model.grid.low + model.grid.cell * (model.grid.cells + 0.5)] * 2)
    views, extras = (
        np.tile(np.array([0.0, 0.0, -1.0], np.float32), (len(points), 1)),
        np.empty((len(points), 4), np.float32),
    )
    light = LIGHT.direction.astype(np.float32)
    one, other = (each.ask(points, views, light, extras) for each in (mug.networks, networks))
    assert one.known.all()
    lost = np.flatnonzero(~other.known)
    assert lost.tolist() == [7, 7 + len(model.grid)]
    np.testing.assert_allclose(other.scattered[other.known], one.scattered[other.known], atol=1e-6)
