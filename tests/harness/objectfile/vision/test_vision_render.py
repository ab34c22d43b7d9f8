"""Pictures from networks whose look is known: fog, planes, shadows; and laws that any picture keeps."""

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from harness.basics.arrays import FloatArray
from harness.basics.errors import DataRefused, WrongUse
from harness.basics.faces.ray_mesh import RayMesh
from harness.basics.mesh import Mesh
from harness.objectfile.vision.network.network import COMPACT, VisionGrid, VisionModel
from harness.objectfile.vision.render import VisionRenderer
from harness.objectfile.vision.settings import RenderSettings, VisionLevel
from harness.objects.household import build
from harness.picture.pinhole import DirectionalLight, Pinhole
from tests.oracles.plain_look import even_look, file_of, filled_grid, looking, shadow_look, sloped_look
from tests.oracles.seen_shapes import cuboid, square, together
from tests.samples.fitted_look import fitted_look

LIGHT = DirectionalLight(np.array([0.3, -0.4, 0.8]))
LEVELS: tuple[VisionLevel, ...] = get_args(VisionLevel)
BOX = cuboid(0.1, 0.08, 0.06)
MUG = build("mug", 8e-3)
ALONE = RenderSettings(coverage=1, termination=0.0)


@pytest.fixture(scope="module")
def mug() -> VisionRenderer:
    """Solved for, not trained: see ``fitted_look``."""
    model, _ = fitted_look(MUG, COMPACT, cells=8, samples=300)
    return VisionRenderer(file_of(model), MUG, threads=2)


def fog(density: float, threads: int = 1) -> VisionRenderer:
    """A box full of it."""
    grid = filled_grid(BOX, 4, 64.0)
    return VisionRenderer(file_of(even_look(grid, density, (0.0, 1.0, -1.0))), BOX, threads, deep=64.0)


def through(low: FloatArray, high: FloatArray, camera: Pinhole) -> FloatArray:
    """Length of every pixel's ray within a box."""
    ways = camera.directions().reshape(-1, 3)
    with np.errstate(divide="ignore"):
        a, b = (low - camera.eye) / ways, (high - camera.eye) / ways
    near = np.maximum(np.minimum(a, b).max(axis=1), 0.0)
    lengths: FloatArray = np.maximum(np.maximum(a, b).min(axis=1) - near, 0.0)
    return lengths


@pytest.mark.parametrize("density", [1e-5, 1e-2, 10.0, 1e3, 1e7])
def test_fog_takes_what_beer_and_lambert_say(density: float) -> None:
    renderer = fog(density)
    camera = looking(BOX, 2.0, 24, 18)
    voxels = np.argwhere(renderer.shell.occupied)
    shell = renderer.shell
    assert len(voxels) == np.prod(np.ptp(voxels, axis=0) + 1), "the box is full"
    low, high = (
        shell.low + shell.voxel * voxels.min(axis=0),
        shell.low + shell.voxel * (voxels.max(axis=0) + 1),
    )
    image = renderer.render(camera, LIGHT, ALONE).image
    wanted = -np.expm1(-renderer.model.weights.density_scale * through(low, high, camera))
    # Thin fog too: a share of 1e-6 is known to float32's own precision.
    np.testing.assert_allclose(image.alpha.ravel(), wanted, rtol=1e-5, atol=1e-12)
    colour = wanted[:, None] / (1.0 + np.exp(-np.array([0.0, 1.0, -1.0])))
    np.testing.assert_allclose(image.colour.reshape(-1, 3), colour, rtol=1e-5, atol=1e-12)


def test_a_sample_more_changes_even_fog_by_nothing() -> None:
    renderer, camera = fog(20.0), looking(BOX, 1.5, 20)
    images = [renderer.render(camera, LIGHT, replace(ALONE, step=step)).image for step in (0.25, 1.0, 10.0)]
    for other in images[1:]:
        np.testing.assert_allclose(other.alpha, images[0].alpha, atol=1e-6)


def test_cells_meet_without_a_seam() -> None:
    """A density that is linear across cells: a plane of known depth, and a colour that only rises."""
    mesh = cuboid(0.1, 0.1, 0.1)
    grid = filled_grid(mesh, 4, 64.0)
    level = 1.5
    renderer = VisionRenderer(file_of(sloped_look(grid, 2, level, 1e6)), mesh, 1, deep=64.0)
    height = grid.low[2] + level * grid.cell
    eye = np.array([0.0, 0.0, 0.5])
    camera = Pinhole.looking_at(eye, (0, 0, 0), (0, 1, 0), 60, 60, np.radians(8.0))
    image = renderer.render(camera, LIGHT, replace(ALONE, step=0.05)).image
    assert image.alpha.min() > 0.999
    # The plane is found to a sample's length; its colour has no step larger than its slope and float16.
    assert np.abs(image.depth - (0.5 - height)).max() < 0.1 * renderer.shell.voxel
    ways = camera.directions()
    y = (image.depth / (ways @ camera.forward))[..., None] * ways
    red = image.colour[..., 0] / image.alpha
    assert np.ptp(red) > 0.05
    share = (y[..., 0] - grid.low[0]) / grid.cell
    np.testing.assert_allclose(red, 1.0 / (1.0 + np.exp(-0.25 * share)), atol=2e-4)


def test_all_ways_to_ask_give_one_picture(mug: VisionRenderer) -> None:
    camera = looking(MUG, 2.0, 48, 40)
    for settings in (RenderSettings(), RenderSettings(coverage=1), RenderSettings(lead=1.0, step=1.0)):
        fused = mug.render(camera, LIGHT, settings)
        graph = mug.render(camera, LIGHT, replace(settings, level="onnx"))
        assert fused.samples == graph.samples
        np.testing.assert_allclose(graph.image.colour, fused.image.colour, atol=1e-3)
        np.testing.assert_allclose(graph.image.alpha, fused.image.alpha, atol=1e-3)
        seen = fused.image.alpha > 0.05
        np.testing.assert_allclose(graph.image.depth[seen], fused.image.depth[seen], atol=1e-5)


def test_how_the_work_is_shared_changes_nothing(mug: VisionRenderer) -> None:
    camera = looking(MUG, 2.0, 40)
    alone = VisionRenderer(mug._data, MUG, threads=1)
    first = mug.render(camera, LIGHT)
    for renderer, wave in ((alone, 4), (mug, 1), (mug, 3), (mug, 64)):
        other = renderer.render(camera, LIGHT, RenderSettings(wave=wave))
        # A ray that goes on begins where float64 rounds to; in the cell, float32 may then round to the other
        # neighbour, 6e-8 away: 2e-6 rad in the sixth octave, times what a network makes of it.
        np.testing.assert_allclose(other.image.colour, first.image.colour, atol=1e-5)
        np.testing.assert_allclose(other.image.alpha, first.image.alpha, atol=1e-5)


def test_what_the_default_leaves_out_changes_less_than_half_a_grey_level(mug: VisionRenderer) -> None:
    """As light and as shown, against every sample of the shell, where networks have fog before the mesh."""
    camera = looking(MUG, 2.0, 64)
    for cover in (1, 5):
        whole = mug.render(camera, LIGHT, RenderSettings(termination=0.0, lead=np.inf, coverage=cover))
        ended = mug.render(camera, LIGHT, RenderSettings(coverage=cover))
        assert ended.samples < 0.5 * whole.samples
        apart = ended.image.colour - whole.image.colour
        assert np.sqrt(np.mean(apart**2)) <= 0.5 / 255.0
        shown = ended.image.display(1.0).astype(np.float64) - whole.image.display(1.0)
        assert np.sqrt(np.mean(shown**2)) <= 0.5


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
    for level in LEVELS:
        alpha = mug.render(camera, LIGHT, RenderSettings(level=level)).image.alpha
        assert not (alpha[~near] > 0.0).any()
        assert (alpha[far] > 0.5).mean() > 0.995


def test_metres_are_metres(mug: VisionRenderer) -> None:
    """Twice as far is half as large, and the depth says how far."""
    near, far = (
        mug.render(looking(MUG, d, 96), LIGHT, RenderSettings(level="one_sample")).image for d in (3.0, 6.0)
    )
    assert near.alpha.sum() / far.alpha.sum() == pytest.approx(4.0, rel=0.08)
    longest = float(np.ptp(MUG.bounds, axis=0).max())
    for image, away in ((near, 3.0), (far, 6.0)):
        assert image.depth[image.alpha > 0].mean() == pytest.approx(away * longest, abs=0.5 * longest)


def test_moving_object_camera_and_light_together_changes_nothing(mug: VisionRenderer) -> None:
    model, shift = mug.model, np.array([0.25, -0.5, 0.125])
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
    # Rounding may put a ray on the other side of a voxel's edge.
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
    assert np.median(np.abs(found.image.depth[both] - single.depth[both])) < mug.shell.voxel


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
    grid = filled_grid(mesh, 8, 1.0)
    renderer = VisionRenderer(file_of(shadow_look(grid, 1e6)), mesh, 1)
    camera = Pinhole.looking_at((0.2, 0, 0.3), (0.05, 0, 0), (0, 0, 1), 60, 60, np.radians(25.0))
    light = DirectionalLight(np.array([-1.0, 0.0, 1.0]))
    for level in LEVELS:
        image = renderer.render(camera, light, RenderSettings(level=level)).image
        ways = camera.directions().reshape(-1, 3)
        hits = RayMesh(mesh).first_hits(camera.eye, ways)
        points = camera.eye + hits.distance[:, None] * ways
        floor = np.isfinite(hits.distance) & (np.abs(points[:, 2]) < 1e-6)
        # The lid's shadow lies 50 mm further along x.
        dark = (
            (np.abs(points[:, 0] - 0.05) < 0.014) & (np.abs(points[:, 1]) < 0.014) & (points[:, 0] < 0.0499)
        )
        bright = (np.abs(points[:, 0] - 0.05) > 0.016) | (np.abs(points[:, 1]) > 0.016)
        red = image.colour[..., 0].ravel() / np.maximum(image.alpha.ravel(), 1e-9)
        full = image.alpha.ravel() > 0.999
        assert (floor & dark & full).sum() > 5
        assert red[floor & dark & full].max() < 0.01, level
        assert red[floor & bright & full].min() > 0.99, level


def test_settings_that_make_no_sense_are_refused() -> None:
    for wrong in ({"level": "nerf"}, {"coverage": 2}, {"step": 0.0}, {"step": np.nan}, {"termination": 1.0}):
        with pytest.raises(WrongUse):
            replace(RenderSettings(), **wrong)
    for more in (
        {"termination": -0.1},
        {"wave": 0},
        {"lead": -1.0},
        {"lead": np.nan},
        {"rays": 0},
        {"rays": 9},
    ):
        with pytest.raises(WrongUse):
            replace(RenderSettings(), **more)
    with pytest.raises(WrongUse):
        VisionRenderer(file_of(even_look(filled_grid(BOX, 4, 1.0), 1.0, (0, 0, 0))), BOX, threads=0)


def test_networks_of_another_object_are_refused() -> None:
    with pytest.raises(DataRefused, match="different objects"):
        VisionRenderer(file_of(even_look(filled_grid(BOX, 4, 1.0), 1.0, (0, 0, 0))), MUG, 1)


def test_seconds_and_samples_are_told(mug: VisionRenderer) -> None:
    found = mug.render(looking(MUG, 2.0, 32), LIGHT)
    parts = sum(value for name, value in found.seconds.items() if name != "render")
    assert 0.0 < parts <= found.seconds["render"] * (1.0 + 1e-9)
    assert found.samples >= found.rays > 0
