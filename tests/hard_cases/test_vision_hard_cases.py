"""The cases on which published neural renderers crash, go grey or err without a word."""

import numpy as np
import pytest

from harness.authoring.vision.surface_cells import surface_cells
from harness.basics.arrays import AnyArray
from harness.basics.errors import DataRefused, OutOfDomain
from harness.basics.mesh import Mesh
from harness.objectfile.runtime import Network
from harness.objectfile.vision.graph import vision_tensors
from harness.objectfile.vision.render import RenderSettings, VisionRenderer
from harness.picture.linear_image import LinearImage
from harness.picture.pinhole import DirectionalLight, Pinhole
from tests.oracles.plain_look import SMALL, box_grid, even_look, file_of, looking
from tests.oracles.seen_shapes import ball, cuboid, square

LIGHT = DirectionalLight(np.array([0.0, 0.0, 1.0]))
OPAQUE = 1e6
BALL = ball(0.05, 3)
THIN = cuboid(0.3, 0.3, 0.0005)


def renderer(mesh: Mesh, density: float = OPAQUE, logit: float = 0.0) -> VisionRenderer:
    model = even_look(surface_cells(mesh, 16), density, (logit, logit, logit))
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
    return Network(file_of(model, 4), "vision.onnx", *vision_tensors(grid, model.weights.size, 4))


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


def test_an_empty_picture_is_black_and_clear(shown: VisionRenderer) -> None:
    camera = Pinhole.looking_at((0, 0, 0.3), (0, 0, 1.0), (0, 1, 0), 9, 7, 1.0)
    for coverage in (1, 5):
        found = shown.render(camera, LIGHT, RenderSettings(coverage=coverage))
        assert found.samples == 0
        assert not found.image.colour.any()
        assert not found.image.alpha.any()
        assert np.isinf(found.image.depth).all()


@pytest.mark.parametrize("size", [(1, 1), (64, 3), (3, 64)])
def test_pictures_that_are_not_square(shown: VisionRenderer, size: tuple[int, int]) -> None:
    found = shown.render(looking(BALL, 2.0, *size), LIGHT)
    assert found.image.alpha.shape == (size[1], size[0])
    assert _is_sound(found.image)


@pytest.mark.parametrize("away", [0.5, 0.51, 25.0])
def test_cameras_near_and_far(shown: VisionRenderer, away: float) -> None:
    """From the ball's own skin to 25 times its size."""
    camera = looking(BALL, away, 40)
    if away == 25.0:
        camera = Pinhole(40, 40, 40.0 * camera.focal_px, (20.0, 20.0), camera.object_from_camera)
    image = shown.render(camera, LIGHT).image
    assert _is_sound(image)
    assert image.alpha.max() > 0.99


def test_a_camera_within_the_object_sees_it_from_within(shown: VisionRenderer) -> None:
    for eye in ((0.0, 0.0, 0.0), (0.03, 0.01, 0.0), (0.0499, 0.0, 0.0)):
        camera = Pinhole.looking_at(eye, (-0.2, 0.0, 0.01), (0, 0, 1), 24, 16, 1.5)
        image = shown.render(camera, LIGHT).image
        assert _is_sound(image)
        assert image.alpha.min() > 0.99


def test_the_greatest_corner_of_the_box_is_in_its_last_cell() -> None:
    grid = box_grid(np.zeros(3), 0.1, (2, 3, 4))
    found = grid.networks(np.array([grid.high, np.zeros(3), grid.high + 1e-6]))
    assert found[0] == len(grid) - 1
    assert found[1] == 0
    assert found[2] == -1


def test_float32_places_at_borders_belong_to_a_neighbour() -> None:
    grid = box_grid(np.array([-0.3, 0.1, 7.0]), 0.1 / 3.0, (5, 5, 5))
    borders = grid.low + grid.cell * np.arange(1, 5)[:, None]
    exact, rounded = grid.networks(borders), grid.networks(borders.astype(np.float32).astype(np.float64))
    apart = np.abs(grid.cells[exact] - grid.cells[rounded])
    assert (apart <= 1).all()


@pytest.mark.parametrize("light", [(0.0, 0.0, -1.0), (1.0, 0.0, 1e-9)])
def test_light_from_behind_and_along_the_surface(light: tuple[float, float, float]) -> None:
    mesh = square(0.1)
    seen = renderer(mesh)
    camera = Pinhole.looking_at((0, 0, 0.3), (0, 0, 0), (0, 1, 0), 20, 20, 0.5)
    assert _is_sound(seen.render(camera, DirectionalLight(np.array(light))).image)


@pytest.mark.parametrize("rise", [1e-3, 1e-7, 0.0])
def test_grazing_rays(rise: float) -> None:
    """Along a sheet, almost or exactly in it: drawn, or seen edge-on and empty, but sound."""
    seen = renderer(square(0.1))
    camera = Pinhole.looking_at((0.3, 0, rise), (0, 0, 0), (0, 0, 1), 31, 31, 0.4)
    for coverage in (1, 5):
        assert _is_sound(seen.render(camera, LIGHT, RenderSettings(coverage=coverage)).image)


def test_a_wall_of_an_eighth_of_a_voxel_is_whole() -> None:
    """0.5 mm in a 0.3 m box."""
    seen = renderer(THIN)
    assert seen.networks.grid.cell / 8.0 > 4.0 * 0.0005
    for along in ((0.2, 0.3, 0.9), (0.9, 0.1, 0.3)):
        camera = looking(THIN, 1.5, 48, along=along)
        alone = seen.render(camera, LIGHT, RenderSettings(coverage=1)).image
        outlined = seen.render(camera, LIGHT, RenderSettings()).image
        assert (alone.alpha[outlined.alpha == 1.0] > 0.99).all()
        assert (outlined.alpha == 1.0).sum() > 50


@pytest.mark.parametrize(("logit", "value"), [(-60000.0, 0.0), (60000.0, 1.0)])
def test_black_on_clear_and_white_on_white(logit: float, value: float) -> None:
    seen = renderer(BALL, logit=logit)
    image = seen.render(looking(BALL, 2.0, 24), LIGHT).image
    np.testing.assert_allclose(image.colour, value * np.repeat(image.alpha[..., None], 3, 2), atol=1e-6)
    over = image.over(value)
    np.testing.assert_allclose(over, value, atol=1e-6)


def test_lights_and_cameras_that_are_none_are_refused_before_any_ray() -> None:
    with pytest.raises(OutOfDomain):
        DirectionalLight(np.zeros(3))
    with pytest.raises(OutOfDomain):
        Pinhole.looking_at((0, 0, 1), (0, 0, 1), (0, 1, 0), 8, 8, 1.0)


def test_a_single_cell_is_a_grid() -> None:
    mesh = cuboid(0.01, 0.01, 0.01)
    grid = surface_cells(mesh, 1)
    assert len(grid) == 1
    seen = VisionRenderer(file_of(even_look(grid, OPAQUE, (0.0, 0.0, 0.0), SMALL)), mesh, 1)
    assert _is_sound(seen.render(looking(mesh, 2.0, 16), LIGHT).image)
