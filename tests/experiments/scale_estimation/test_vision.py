"""Size by sight: outlines of a model itself are read back, and what is not of it is refused."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.scale_estimation.size import SizeRange
from experiments.scale_estimation.vision.vision import NO_SIZE, View, by_sight
from harness.basics.arrays import BoolArray, FloatArray
from harness.basics.errors import DataRefused, FitRefused
from harness.basics.geometry import transform
from harness.objects.household import build
from harness.picture.camera_errors import CameraErrors
from harness.picture.object_mask import mask_by_background
from harness.picture.outline import SeenOutline, directions, read_outline
from mocks.world.world import Body, SceneView

RANGE = SizeRange(0.05, 0.45)
ROWS, COLUMNS, FOCAL = 480, 640, 600.0
PLACE = np.array([-0.42, 0.0, 0.25])


def camera() -> FloatArray:
    eye = np.array([-1.2, -0.7, 0.75])
    z = PLACE - eye
    z /= np.linalg.norm(z)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    return transform(np.stack([x, np.cross(z, x), z], axis=1), eye)


def standing(name: str) -> FloatArray:
    vertices = build(name).vertices
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    return np.asarray(vertices - [*(0.5 * (low + high))[:2], low[2]])


def view_of(name: str, errors: CameraErrors | None = None) -> View:
    centre = (COLUMNS / 2, ROWS / 2)
    return View(camera(), FOCAL, centre, standing(name), PLACE, errors or CameraErrors())


def nominal(view: View) -> float:
    return float(np.ptp(view.standing, axis=0).max())


def outline_at(view: View, scale: float, x: float = 0.0, y: float = 0.0, yaw: float = 0.0) -> SeenOutline:
    unknowns = np.zeros((1, 14))
    unknowns[0, :4] = np.log(scale), x, y, yaw
    extents = (view.project(unknowns, view.corners)[0] @ directions().T).max(axis=0)
    return SeenOutline(extents, np.zeros(len(extents), bool))


def mask_at(name: str, scale: float) -> BoolArray:
    mesh = build(name)
    moved = replace(mesh, vertices=standing(name) * scale)
    seen = SceneView(camera(), ROWS, COLUMNS, FOCAL, [Body(moved, transform(np.eye(3), PLACE), (200, 0, 0))])
    return np.asarray(seen.picture([])[..., 0] > seen.picture([])[..., 2] + 5)


@pytest.mark.parametrize("name", ["mug", "bowl", "tray", "wrench"])
@pytest.mark.parametrize(("scale", "yaw"), [(0.6, 0.4), (1.7, 4.0)])
def test_a_model_s_own_outline_gives_its_size(name: str, scale: float, yaw: float) -> None:
    view = view_of(name)
    true = scale * nominal(view)
    found = by_sight(view, outline_at(view, scale, 0.01, -0.02, yaw), nominal(view), RANGE)
    assert found.belief.size == pytest.approx(true, rel=5e-3)
    low, high = found.belief.interval
    assert low < true < high
    assert 0.003 < found.belief.spread < 0.03  # what the camera's own errors leave


def test_a_drawn_mask_gives_it_within_a_hundredth() -> None:
    view = view_of("mug")
    for scale in (0.6, 1.0, 1.6):
        found = by_sight(view, read_outline(mask_at("mug", scale)), nominal(view), RANGE)
        assert found.belief.size == pytest.approx(scale * nominal(view), rel=0.01)


def test_what_hides_a_side_leaves_the_size_and_widens_it() -> None:
    view = view_of("mug")
    whole = outline_at(view, 1.3)
    right = directions()[:, 0] > 0.3
    cut = SeenOutline(whole.extents - 15.0 * right, right)
    found = by_sight(view, cut, nominal(view), RANGE)
    seen = by_sight(view, whole, nominal(view), RANGE)
    low, high = found.belief.interval
    assert low < 1.3 * nominal(view) < high
    assert found.belief.spread > seen.belief.spread


@pytest.mark.parametrize("scale", [0.35, 2.6])
def test_a_size_beyond_the_range_is_named(scale: float) -> None:
    view = view_of("mug")
    asked = SizeRange(0.5 * nominal(view), 2.0 * nominal(view))
    assert by_sight(view, outline_at(view, scale), nominal(view), asked).belief.outside > 0.5


def test_another_object_is_refused() -> None:
    view, other = view_of("mug"), outline_at(view_of("wrench"), 0.8, yaw=0.7)
    with pytest.raises(FitRefused, match=r"2\.0 px.*0\.9 px"):
        by_sight(view, other, nominal(view), RANGE)


@pytest.mark.parametrize("unknown", [{"position": 1.0}, {"support": 0.5}])
def test_without_the_camera_s_place_or_the_support_s_a_picture_says_hardly_anything(
    unknown: dict[str, float],
) -> None:
    view = view_of("mug", CameraErrors(**unknown))
    found = by_sight(view, outline_at(view, 1.2), nominal(view), RANGE)
    low, high = found.belief.interval
    assert np.log(high / low) > NO_SIZE


def test_no_object_is_no_outline() -> None:
    with pytest.raises(DataRefused, match=r" 0 pixels.*12 "):
        read_outline(np.zeros((ROWS, COLUMNS), bool))


def test_the_picture_s_border_hides() -> None:
    mask = np.zeros((ROWS, COLUMNS), bool)
    mask[100:200, 600:] = True
    outline = read_outline(mask)
    assert outline.hidden[0]
    assert not outline.hidden[len(outline.hidden) // 2]


def test_a_mask_of_nearly_the_whole_picture_is_no_outline() -> None:
    with pytest.raises(DataRefused, match="border"):
        read_outline(np.ones((ROWS, COLUMNS), bool))


@pytest.mark.parametrize("noise", [0.0, 3.0, 8.0])
def test_a_noisy_camera_is_not_taken_for_an_object_all_over(noise: float) -> None:
    mask = mask_at("mug", 1.2)
    random, bare = np.random.default_rng(0), np.full((ROWS, COLUMNS, 3), 90.0)
    live = np.where(mask[..., None], 200.0, bare)
    seen, without = (
        np.clip(picture + noise * random.standard_normal(picture.shape), 0, 255).astype(np.uint8)
        for picture in (live, bare)
    )
    found = read_outline(np.asarray(mask_by_background(seen, without)))
    assert found.extents == pytest.approx(read_outline(mask).extents, abs=1.0)
