"""The cases on which published neural renderers crash, go grey or err without a word."""

import math
from typing import Any, get_args

import numpy as np
import pytest
from numba import njit
from numba.extending import intrinsic

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.errors import DataRefused, OutOfDomain
from harness.basics.mesh import Mesh
from harness.objectfile.runtime import Network
from harness.objectfile.vision.coverage.blocks import composite, sort_samples
from harness.objectfile.vision.network.network import VisionGrid
from harness.objectfile.vision.network.tensors import vision_tensors
from harness.objectfile.vision.network.tiles import layer_tile
from harness.objectfile.vision.render import VisionRenderer
from harness.objectfile.vision.settings import RenderSettings, VisionLevel
from harness.objectfile.vision.shell import grid_of, lattice_of, surface_shell
from harness.objectfile.vision.voxels import walk
from harness.picture.linear_image import LinearImage
from harness.picture.pinhole import DirectionalLight, Pinhole
from tests.oracles.plain_look import SMALL, box_grid, even_look, file_of, filled_grid, looking
from tests.oracles.seen_shapes import ball, cuboid, square

LEVELS: tuple[VisionLevel, ...] = get_args(VisionLevel)
LIGHT = DirectionalLight(np.array([0.0, 0.0, 1.0]))
OPAQUE = 1e6
BALL = ball(0.05, 3)
THIN = cuboid(0.3, 0.3, 0.0005)


def renderer(mesh: Mesh, density: float = OPAQUE, logit: float = 0.0) -> VisionRenderer:
    model = even_look(filled_grid(mesh, 16, 1.0), density, (logit, logit, logit))
    return VisionRenderer(file_of(model), mesh, threads=1)


@pytest.fixture(scope="module")
def shown() -> VisionRenderer:
    return renderer(BALL)


def _is_sound(image: LinearImage) -> bool:
    finite = np.isfinite(image.colour).all() and np.isfinite(image.alpha).all()
    known = (image.depth[np.isfinite(image.depth)] >= 0.0).all() and not np.isnan(image.depth).any()
    within = (image.alpha >= 0.0).all() and (image.alpha <= 1.0).all() and (image.colour >= 0.0).all()
    return bool(finite and known and within)


def _asked(model_blocks: AnyArray) -> dict[str, AnyArray]:
    count = len(model_blocks)
    return {
        "network": model_blocks[:, None],
        "points": np.zeros((count, 4, 3)),
        "views": np.zeros((count, 4, 3), np.float32),
        "light": np.zeros((count, 3), np.float32),
    }


@pytest.fixture(scope="module")
def graph() -> Network:
    grid = box_grid(np.zeros(3), 0.1, (3, 1, 1))
    model = even_look(grid, 1.0, (0.0, 0.0, 0.0))
    model.weights.density_bias[:, 0] = [1.0, 2.0, 3.0]
    return Network(file_of(model, 4), "vision.onnx", *vision_tensors(model, 4))


def test_the_graph_alone_takes_network_minus_one_for_the_last(graph: Network) -> None:
    """Why what is outside is left out before: nothing here says that the answer is another cell's."""
    found = graph(_asked(np.array([-1, 2])))["density"]
    assert np.array_equal(found[0], found[1])
    assert (found == 3.0).all()


@pytest.mark.parametrize("network", [3, 1000, -4])
def test_a_network_out_of_range_is_refused_by_the_graph(graph: Network, network: int) -> None:
    with pytest.raises(DataRefused):
        graph(_asked(np.array([0, network])))


def test_no_block_at_all_is_answered_with_none(graph: Network) -> None:
    found = graph(_asked(np.zeros(0, np.int64)))
    assert found["density"].shape == (0, 4, 1)
    assert found["scattered"].shape == (0, 4, 3)


def test_samples_without_a_network_are_in_no_block() -> None:
    counts, networks = np.array([3, 0, 2], np.int32), np.array([1, -1, 0, 9, 9, 9, -1, 1, 9], np.int32)
    order, blocks = np.zeros(9, np.int32), np.zeros((8, 3), np.int32)
    total, made = sort_samples(counts, 3, networks, 2, 32, order, blocks)
    assert (total, made) == (3, 2)
    assert order[:3].tolist() == [2, 0, 7]
    assert blocks[:2].tolist() == [[0, 0, 1], [1, 1, 2]]


@pytest.mark.parametrize("level", LEVELS)
def test_an_empty_picture_is_black_and_clear(shown: VisionRenderer, level: VisionLevel) -> None:
    camera = Pinhole.looking_at((0, 0, 0.3), (0, 0, 1.0), (0, 1, 0), 9, 7, 1.0)
    for coverage in (1, 5):
        found = shown.render(camera, LIGHT, RenderSettings(level=level, coverage=coverage))
        assert found.samples == 0
        assert not found.image.colour.any()
        assert not found.image.alpha.any()
        assert np.isinf(found.image.depth).all()


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("size", [(1, 1), (64, 3), (3, 64)])
def test_pictures_that_are_not_square(
    shown: VisionRenderer, level: VisionLevel, size: tuple[int, int]
) -> None:
    found = shown.render(looking(BALL, 2.0, *size), LIGHT, RenderSettings(level=level))
    assert found.image.alpha.shape == (size[1], size[0])
    assert _is_sound(found.image)


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("away", [0.5, 0.51, 25.0])
def test_cameras_near_and_far(shown: VisionRenderer, level: VisionLevel, away: float) -> None:
    """From the ball's own skin to 25 times its size."""
    camera = looking(BALL, away, 40)
    if away == 25.0:
        camera = Pinhole(40, 40, 40.0 * camera.focal_px, (20.0, 20.0), camera.object_from_camera)
    image = shown.render(camera, LIGHT, RenderSettings(level=level)).image
    assert _is_sound(image)
    assert image.alpha.max() > 0.99


@pytest.mark.parametrize("level", LEVELS)
def test_a_camera_within_the_object_sees_it_from_within(shown: VisionRenderer, level: VisionLevel) -> None:
    for eye in ((0.0, 0.0, 0.0), (0.03, 0.01, 0.0), (0.0499, 0.0, 0.0)):
        camera = Pinhole.looking_at(eye, (-0.2, 0.0, 0.01), (0, 0, 1), 24, 16, 1.5)
        image = shown.render(camera, LIGHT, RenderSettings(level=level)).image
        assert _is_sound(image)
        assert image.alpha.min() > 0.99


def test_rays_along_the_faces_of_voxels_are_taken_or_left_but_never_lost() -> None:
    """Axis-parallel, on faces, edges and the box itself: 0 times infinity is nowhere."""
    mesh = cuboid(0.1, 0.1, 0.1)
    lattice = lattice_of(mesh, 8)
    shell = surface_shell(mesh, lattice)
    runs = np.empty((64, 2))
    sides = 4.0 * np.array(shell.words.shape)
    first = np.argwhere(shell.occupied).min(axis=0)
    last = np.argwhere(shell.occupied).max(axis=0) + 1
    for axis in range(3):
        for sign in (-1.0, 1.0):
            way = sign * np.eye(3)[axis]
            for other in np.arange(first[(axis + 1) % 3] + 1.0, last[(axis + 1) % 3] - 0.0):
                eye = 0.5 * sides
                eye[(axis + 1) % 3], eye[axis] = other, -7.0 if sign > 0.0 else sides[axis] + 7.0
                count, after = walk(eye, way, 0.0, shell.near, runs)
                ends = runs[:count]
                assert after == np.inf
                assert np.isfinite(ends).all()
                # Through a hollow box: both its walls are met, on a face between voxels as within one.
                assert count >= 1
                assert ends[0, 0] == pytest.approx(7.0 + (first if sign > 0.0 else sides - last)[axis])
    for corner in ((0.0, 0.0), (0.0, sides[2]), (sides[1], sides[2])):
        count, _ = walk(np.array([-1.0, *corner]), np.array([1.0, 0.0, 0.0]), 0.0, shell.near, runs)
        assert np.isfinite(runs[:count]).all()
    assert walk(np.array([-1.0, -0.1, 5.0]), np.array([1.0, 0.0, 0.0]), 0.0, shell.near, runs)[0] == 0


def test_the_greatest_corner_of_the_box_is_in_its_last_cell() -> None:
    grid = box_grid(np.zeros(3), 0.1, (2, 3, 4))
    found = grid.networks(np.array([grid.high, np.zeros(3), grid.high + 1e-9]))
    assert found[0] == len(grid) - 1
    assert found[1] == 0
    assert found[2] == -1
    np.testing.assert_allclose(grid.local(grid.high[None], found[:1]), 1.0)


def test_float32_places_at_borders_belong_to_a_neighbour() -> None:
    grid = box_grid(np.array([-0.3, 0.1, 7.0]), 0.1 / 3.0, (5, 5, 5))
    borders = grid.low + grid.cell * np.arange(1, 5)[:, None]
    exact, rounded = grid.networks(borders), grid.networks(borders.astype(np.float32).astype(np.float64))
    apart = np.abs(grid.cells[exact] - grid.cells[rounded])
    assert (apart <= 1).all()
    local = grid.local(borders, rounded)
    assert (np.abs(local) <= 1.0).all()


def _composited(density: FloatArray, lengths: FloatArray, least: float = 0.0) -> FloatArray:
    """One ray's sums."""
    count = len(density)
    resume, optical, sums = np.zeros(1), np.zeros(1), np.zeros((1, 5))
    ray, counts, networks = np.zeros(1, np.int32), np.array([count], np.int32), np.zeros(count, np.int32)
    thick, white = density.astype(np.float32), np.ones((count, 3), np.float32)
    long, places = lengths.astype(np.float32), np.ones(count, np.float32)
    composite(ray, counts, count, networks, thick, white, long, places, 1.0, least, resume, optical, sums)
    return np.asarray(sums[0])


def test_thin_samples_are_not_lost() -> None:
    """``1 - exp(-x)`` of 1e-9 is nothing in float32, and a product of ones with 1e-10 stays one."""
    count, thin = 10_000, 1e-9
    found = _composited(np.full(count, thin), np.ones(count))
    assert found[3] == pytest.approx(-math.expm1(-count * float(np.float32(thin))), rel=1e-9)


@pytest.mark.parametrize("density", [1e6, 1e20, 3e38])
def test_what_is_thicker_than_any_number_is_opaque(density: float) -> None:
    found = _composited(np.array([0.0, density, density]), np.array([1e-3, 1e4, 1e4]))
    np.testing.assert_allclose(found, [1.0, 1.0, 1.0, 1.0, 1.0])


def test_a_ray_that_ends_early_counts_as_all() -> None:
    kept = _composited(np.array([1.0, 1.0, 5.0]), np.ones(3), 0.2)
    np.testing.assert_allclose(kept, 1.0)


def test_an_infinite_length_of_nothing_is_no_nan() -> None:
    found = _composited(np.zeros(1), np.array([np.inf]))
    np.testing.assert_allclose(found, 1.0)


@pytest.mark.parametrize("light", [(0.0, 0.0, -1.0), (1.0, 0.0, 1e-9)])
def test_light_from_behind_and_along_the_surface(light: tuple[float, float, float]) -> None:
    mesh = square(0.1)
    seen = renderer(mesh)
    camera = Pinhole.looking_at((0, 0, 0.3), (0, 0, 0), (0, 1, 0), 20, 20, 0.5)
    for level in LEVELS:
        assert _is_sound(
            seen.render(camera, DirectionalLight(np.array(light)), RenderSettings(level=level)).image
        )


@pytest.mark.parametrize("rise", [1e-3, 1e-7, 0.0])
def test_grazing_rays(rise: float) -> None:
    """Along a sheet, almost or exactly in it: drawn, or seen edge-on and empty, but sound."""
    seen = renderer(square(0.1))
    camera = Pinhole.looking_at((0.3, 0, rise), (0, 0, 0), (0, 0, 1), 31, 31, 0.4)
    for level in LEVELS:
        for coverage in (1, 5):
            assert _is_sound(seen.render(camera, LIGHT, RenderSettings(level=level, coverage=coverage)).image)


def test_a_wall_of_an_eighth_of_a_voxel_is_whole() -> None:
    """0.5 mm in a 0.3 m box: no sample falls between its two sides."""
    seen = renderer(THIN)
    assert seen.shell.voxel > 4.0 * 0.0005
    for along in ((0.2, 0.3, 0.9), (0.9, 0.1, 0.3)):
        camera = looking(THIN, 1.5, 48, along=along)
        alone = seen.render(camera, LIGHT, RenderSettings(coverage=1)).image
        outlined = seen.render(camera, LIGHT, RenderSettings()).image
        assert (alone.alpha[outlined.alpha == 1.0] > 0.99).all()
        assert (outlined.alpha == 1.0).sum() > 50


@pytest.mark.parametrize(("logit", "value"), [(-60000.0, 0.0), (60000.0, 1.0)])
def test_black_on_clear_and_white_on_white(logit: float, value: float) -> None:
    seen = renderer(BALL, logit=logit)
    for level in LEVELS:
        image = seen.render(looking(BALL, 2.0, 24), LIGHT, RenderSettings(level=level)).image
        np.testing.assert_allclose(image.colour, value * np.repeat(image.alpha[..., None], 3, 2), atol=1e-6)
        over = image.over(value)
        np.testing.assert_allclose(over, value, atol=1e-6)


def test_nothing_there_is_clear(shown: VisionRenderer) -> None:
    """A network of no density: no depth, no colour, no division by nothing."""
    model = even_look(filled_grid(BALL, 16, 1.0), 1.0, (0.0, 0.0, 0.0))
    model.weights.density_bias[:] = -1.0
    empty = VisionRenderer(file_of(model), BALL, 1)
    image = empty.render(looking(BALL, 2.0, 16), LIGHT).image
    assert not image.alpha.any()
    assert np.isinf(image.depth).all()


def test_lights_and_cameras_that_are_none_are_refused_before_any_ray() -> None:
    with pytest.raises(OutOfDomain):
        DirectionalLight(np.zeros(3))
    with pytest.raises(OutOfDomain):
        Pinhole.looking_at((0, 0, 1), (0, 0, 1), (0, 1, 0), 8, 8, 1.0)


def test_a_processor_with_narrow_registers_computes_the_same() -> None:
    """The tile of 16 registers of 8 numbers, run here as the wide one is."""
    narrow: Any = intrinsic(layer_tile(4, 8, 2, relu=True))

    def run(given: AnyArray, weight: AnyArray, bias: AnyArray, out: AnyArray) -> None:
        narrow(given.ctypes.data, weight.ctypes.data, bias.ctypes.data, out.ctypes.data, len(given))

    random = np.random.default_rng(0)
    given, weight = (
        random.standard_normal((23, 16)).astype("f4"),
        random.standard_normal((23, 4)).astype("f4"),
    )
    bias, out = random.standard_normal(4).astype("f4"), np.zeros((4, 16), "f4")
    compiled: Any = njit(run)
    compiled(given, weight, bias, out)
    np.testing.assert_allclose(out, np.maximum(weight.T @ given + bias[:, None], 0.0), atol=1e-5)


def test_a_single_cell_is_a_grid() -> None:
    mesh = cuboid(0.01, 0.01, 0.01)
    lattice = lattice_of(mesh, 1)
    grid = grid_of(surface_shell(mesh, lattice), lattice)
    assert isinstance(grid, VisionGrid)
    assert len(grid) == 1
    seen = VisionRenderer(file_of(even_look(grid, OPAQUE, (0.0, 0.0, 0.0), SMALL)), mesh, 1)
    assert _is_sound(seen.render(looking(mesh, 2.0, 16), LIGHT).image)
