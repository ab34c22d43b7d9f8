"""The touch term: highest where the press was, never below its cap, forgiving what is unknown."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from experiments.contact_localization.touch.kernels import similarities_at
from experiments.contact_localization.touch.touch import (
    TouchMap,
    TouchNoise,
    best_fit,
    touch_map,
    touch_terms,
    view_scores,
)
from harness.basics.arrays import FloatArray
from harness.basics.geometry import rotation_about
from harness.bench.sensor import GELSIGHT_R15
from harness.sim.gel.height_map import RasterMesh, first_surface
from harness.sim.gel.view import ToolView, view_along
from tests.samples.synthetic_press import BLOCK, Press, felt, stepped_block

NOISE = TouchNoise()
THRESHOLD = 0.12e-3
PITCH = GELSIGHT_R15.pitch * BLOCK
PEG = (-0.02, 0.012, 0.0255)
CORNER = (0.034, -0.024, 0.025)
DOWN = (0.0, 0.0, -1.0)
ASLANT = (0.1, 0.05, -np.sqrt(1.0 - 0.0125))
PRESSES = {
    "on the peg": Press(PEG, DOWN, yaw=0.4),
    "turned": Press(PEG, DOWN, yaw=2.5),
    "deep": Press(PEG, DOWN, yaw=0.4, depth=1.8e-3),
    "shallow": Press(PEG, DOWN, yaw=0.4, depth=0.4e-3),
    "on the peg's rim, aslant": Press((-0.0175, 0.0135, 0.0255), ASLANT, yaw=1.1),
    "on a corner of the step": Press(CORNER, DOWN, yaw=-0.8),
}


@pytest.fixture(scope="module")
def block() -> RasterMesh:
    return RasterMesh(stepped_block())


def seen(block: RasterMesh, press: Press, off: float = 0.0) -> ToolView:
    """Along the tool as it is believed to have stood, ``off`` rad about the gel's y axis from how it did."""
    rotation = press.object_from_gel[:3, :3] @ rotation_about(np.array([0.0, 1.0, 0.0]), off)
    return view_along(partial(first_surface, block), block.mesh.vertices, rotation, 0.5 * PITCH, GELSIGHT_R15)


def read(block: RasterMesh, press: Press) -> TouchMap:
    return touch_map(felt(block, press), GELSIGHT_R15.pitch, BLOCK, NOISE.skirt, NOISE.edge, THRESHOLD)


def centre_in(view: ToolView, press: Press) -> FloatArray:
    return np.asarray(press.object_from_gel[:3, 3] @ view.object_from_view)


def every_place(view: ToolView, press: Press) -> FloatArray:
    """The gel's centre ``depth`` beyond the first surface, at every pixel that has one."""
    rows, columns = np.nonzero(np.isfinite(view.depth))
    xy = view.origin + view.pitch * np.column_stack([columns, rows])
    return np.column_stack([xy, view.depth[rows, columns] + press.depth])


def terms(view: ToolView, touch: TouchMap, places: FloatArray) -> FloatArray:
    return touch_terms(view, touch, NOISE, places, step=1, rings=2, shift=NOISE.shift, temperature=1.0)


@pytest.mark.parametrize("name", PRESSES)
def test_the_term_is_highest_at_the_true_place(block: RasterMesh, name: str) -> None:
    press = PRESSES[name]
    view, touch = seen(block, press), read(block, press)
    places = every_place(view, press)
    found = terms(view, touch, places)
    best, true = places[np.argmax(found)], centre_in(view, press)
    if "corner" in name:
        # The step has corners that feel alike under this attitude: none may feel better than the true one.
        assert terms(view, touch, true[None])[0] > found.max() - 0.5
        return
    # A cell is half a millimetre, and the term is a mixture over two of them each way.
    assert np.linalg.norm((best - true)[:2]) < 1.0e-3


@pytest.mark.parametrize("name", PRESSES)
def test_the_fit_finds_how_deep_the_gel_was(block: RasterMesh, name: str) -> None:
    press = PRESSES[name]
    view, touch = seen(block, press), read(block, press)
    true = centre_in(view, press)
    pixel = np.round((true[:2] - view.origin) / view.pitch).astype(np.int64)[::-1]
    view_scores(view, touch, NOISE, pixel[None])
    assert view.gel_depth[tuple(pixel)] == pytest.approx(true[2], abs=0.15e-3)


def fit_of(block: RasterMesh, press: Press) -> float:
    view = seen(block, press)
    return best_fit(view, read(block, press), NOISE, centre_in(view, press), NOISE.shift)


@pytest.mark.parametrize("name", [name for name in PRESSES if name != "deep"])
def test_a_true_place_of_an_exact_reading_costs_less_than_half_the_cap(block: RasterMesh, name: str) -> None:
    """Not nothing: the gel's skirt is not the estimator's, here as at the bench."""
    assert -0.5 * NOISE.cap < fit_of(block, PRESSES[name]) <= 0.0


def test_what_the_skirts_differ_by_grows_with_the_depth_and_its_cost_with_the_square(
    block: RasterMesh,
) -> None:
    costs = [-fit_of(block, Press(PEG, DOWN, yaw=0.4, depth=depth)) for depth in (0.5e-3, 1e-3, 2e-3)]
    assert costs[0] < costs[1] < 4.0 * costs[0]
    assert costs[1] < costs[2] < 4.0 * costs[1]


@pytest.mark.parametrize("depth", [0.3e-3, 1e-3, 2e-3])
def test_a_level_face_that_fills_the_gel_costs_nothing_however_deep(block: RasterMesh, depth: float) -> None:
    assert fit_of(block, Press((0.0, -0.025, 0.0), (0.0, 1.0, 0.0), yaw=0.2, depth=depth)) > -0.1


@pytest.mark.parametrize(
    "along", [np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])]
)
def test_the_term_falls_with_the_distance_from_the_true_place(block: RasterMesh, along: FloatArray) -> None:
    press = PRESSES["on the peg"]
    view, touch = seen(block, press), read(block, press)
    true = centre_in(view, press)
    for side in (1.0, -1.0):
        steps = side * np.array([0.0, 1.5e-3, 3e-3, 6e-3])
        found = terms(view, touch, true + steps[:, None] * along)
        assert np.all(np.diff(found) <= 1e-9)
        assert found[0] - found[1] > 0.5
        assert found[-1] == pytest.approx(-NOISE.cap, abs=0.1)


def test_no_place_costs_more_than_the_cap(block: RasterMesh) -> None:
    press = PRESSES["on the peg"]
    view, touch = seen(block, press), read(block, press)
    somewhere = np.random.default_rng(0).uniform(-0.2, 0.2, (500, 3))
    found = terms(view, touch, somewhere)
    assert found.min() >= -NOISE.cap
    beside = terms(view, touch, np.array([[5.0, 5.0, 0.0]]))
    assert beside[0] == pytest.approx(-NOISE.cap, abs=1e-12)
    assert best_fit(view, touch, NOISE, np.array([5.0, 5.0, 0.0]), NOISE.shift) == -np.inf


def test_where_the_tool_stood_forgives_the_tilt_that_is_not_known(block: RasterMesh) -> None:
    """On a level face a tilt is all that can differ: half its square in sigmas."""
    press = Press((0.0, -0.025, 0.0), (0.0, 1.0, 0.0), yaw=0.2)
    touch = read(block, press)
    for sigmas in (0.0, 1.0, 2.0):
        view = seen(block, press, off=sigmas * NOISE.tilt)
        pixel = np.round((centre_in(view, press)[:2] - view.origin) / view.pitch).astype(np.int64)[::-1]
        view_scores(view, touch, NOISE, pixel[None])
        assert view.score[tuple(pixel)] == pytest.approx(-0.5 * sigmas**2, abs=0.05 + 0.05 * sigmas**2)


def test_a_cooler_term_is_flatter_and_keeps_its_best(block: RasterMesh) -> None:
    press = PRESSES["on the peg"]
    view, touch = seen(block, press), read(block, press)
    places = centre_in(view, press) + np.random.default_rng(1).normal(size=(60, 3)) * 0.5e-3
    hot = touch_terms(view, touch, NOISE, places, 1, 2, NOISE.shift, 1.0)
    cool = touch_terms(view, touch, NOISE, places, 1, 2, NOISE.shift, 0.3)
    assert np.all(cool >= hot - 1e-9)


def test_the_mean_height_is_kept_where_blocks_divide_the_image() -> None:
    heights = np.random.default_rng(0).random((120, 160)) * 1e-3
    touch = touch_map(heights, GELSIGHT_R15.pitch, BLOCK, NOISE.skirt, NOISE.edge, THRESHOLD)
    assert touch.heights.shape == (15, 20)
    assert touch.heights.mean() == pytest.approx(heights.mean())
    assert touch.heights[3, 4] == pytest.approx(heights[24:32, 32:40].mean())
    assert touch.pitch == pytest.approx(PITCH)


def test_pixels_left_over_are_cut_evenly_so_that_the_centre_stays() -> None:
    """16 into 120 leaves 8 rows, 4 at each end."""
    heights = np.zeros((120, 160))
    heights[4:20] = 1e-3
    touch = touch_map(heights, GELSIGHT_R15.pitch, 16, NOISE.skirt, NOISE.edge, THRESHOLD)
    assert touch.heights.shape == (7, 10)
    assert touch.heights[0] == pytest.approx(1e-3)
    assert touch.heights[1:] == pytest.approx(0.0)


def test_only_what_is_deep_is_surely_touched() -> None:
    x = np.arange(160.0)
    heights = np.tile(np.clip(1e-3 * (1.0 - x / 120.0), 0.0, None), (120, 1))
    touch = touch_map(heights, GELSIGHT_R15.pitch, BLOCK, NOISE.skirt, NOISE.edge, THRESHOLD)
    sure = np.zeros(touch.heights.shape, np.bool_)
    sure[tuple(touch.touched.T)] = True
    assert sure.any()
    np.testing.assert_array_equal(sure, touch.heights > 0.4 * touch.heights.max())


@pytest.mark.parametrize(("peak", "shown"), [(0.0, False), (0.11e-3, False), (0.13e-3, True)])
def test_a_map_below_the_threshold_shows_no_contact(peak: float, shown: bool) -> None:
    heights = np.zeros((120, 160))
    heights[40:80, 60:100] = peak
    touch = touch_map(heights, GELSIGHT_R15.pitch, BLOCK, NOISE.skirt, NOISE.edge, THRESHOLD)
    assert (len(touch.touched) > 0) == shown


def test_level_is_what_is_pressed_and_does_not_slope() -> None:
    heights = np.zeros((120, 160))
    heights[:, :80] = 1e-3
    heights[:, 80:120] = np.linspace(1e-3, 0.0, 40)
    touch = touch_map(heights, GELSIGHT_R15.pitch, BLOCK, NOISE.skirt, NOISE.edge, THRESHOLD)
    assert touch.flat[:, :9].all()
    # 1 mm over 40 pixels of 0.1245 mm is a slope of 0.2; beyond, the gel is at rest.
    assert not touch.flat[:, 10:].any()


def test_blurs_are_the_gaussians_asked_for() -> None:
    touch = touch_map(np.ones((120, 160)), GELSIGHT_R15.pitch, BLOCK, 3e-3, 0.6e-3, THRESHOLD)
    for half, sigma in ((touch.skirt, 3e-3), (touch.edge, 0.6e-3)):
        kernel = np.r_[half[:0:-1], half]
        assert kernel.sum() == pytest.approx(1.0)
        at = touch.pitch * (np.arange(len(kernel)) - len(half) + 1)
        # Cut off at 2.5 sigma, a Gaussian keeps 0.955 of its sigma; sampled coarsely, a little more.
        assert np.sqrt(kernel @ at**2) == pytest.approx(0.955 * sigma, rel=0.08)


def test_a_reading_can_not_be_written_to(block: RasterMesh) -> None:
    touch = read(block, PRESSES["deep"])
    for array in (touch.heights, touch.touched, touch.flat, touch.skirt, touch.edge):
        assert not array.flags.writeable


def test_the_paper_s_cosine_is_highest_near_the_true_place_and_between_0_and_1(block: RasterMesh) -> None:
    press = PRESSES["on the peg"]
    view, touch = seen(block, press), read(block, press)
    places = every_place(view, press) - np.array([0.0, 0.0, press.depth])
    found = similarities_at(view.origin, view.pitch, view.depth, touch.reading, places, 1.5e-3)
    assert found.min() >= 0.0
    assert found.max() <= 1.0 + 1e-12
    assert np.linalg.norm(places[np.argmax(found)][:2] - centre_in(view, press)[:2]) < 1e-3
    centre = centre_in(view, press)[None] - np.array([0.0, 0.0, press.depth])
    true = similarities_at(view.origin, view.pitch, view.depth, touch.reading, centre, 1.5e-3)
    assert true[0] > found.max() - 0.01


def off_by(view: ToolView, rms: float) -> ToolView:
    """The view as a model has it that errs smoothly, with nothing filled in yet."""
    bumps = gaussian_filter(np.random.default_rng(1).normal(size=view.depth.shape), 3.0)
    missing = np.full(view.depth.shape, np.nan)
    depth = view.depth + rms * bumps / bumps.std()
    return replace(view, depth=depth, score=missing, gel_depth=missing.copy())


@pytest.mark.parametrize("name", PRESSES)
def test_what_a_model_is_off_by_as_stated_costs_a_true_place_one_sigma_at_most(
    block: RasterMesh, name: str
) -> None:
    """Of root mean squares: that of a sum is no more than the sum of both."""
    press, rms = PRESSES[name], 0.15e-3
    view, touch = seen(block, press), read(block, press)
    exact, unstated, stated = (
        best_fit(each, touch, noise, centre_in(view, press), NOISE.shift)
        for each, noise in (
            (view, NOISE),
            (off_by(view, rms), NOISE),
            (off_by(view, rms), NOISE.with_model(rms, touch)),
        )
    )
    assert stated >= -0.5 * (np.sqrt(-2.0 * exact) + 1.0) ** 2
    assert stated > unstated


def test_an_exact_model_adds_nothing(block: RasterMesh) -> None:
    assert NOISE.with_model(0.0, read(block, PRESSES["deep"])) == NOISE
