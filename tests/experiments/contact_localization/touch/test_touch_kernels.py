"""The touch term's loops against the same formulas in plain array arithmetic."""

from functools import partial

import numpy as np
import pytest
from scipy.ndimage import correlate1d

from experiments.contact_localization.touch import kernels as touch_kernels
from experiments.contact_localization.touch.touch import (
    TouchMap,
    TouchNoise,
    touch_map,
    touch_terms,
    view_scores,
)
from harness.basics.arrays import BoolArray, FloatArray, IntArray, read_only
from harness.basics.geometry import rotation_about
from harness.bench.sensor import GELSIGHT_R15
from harness.sim.gel.height_map import RasterMesh, first_surface
from harness.sim.gel.view import POOL, ToolView, view_along
from tests.samples.synthetic_press import BLOCK, Press, felt, stepped_block

NOISE = TouchNoise()
CORE, SUNKEN, WITHIN = 0.2, -6e-3, 0.35
EDGE = Press((0.008, -0.005, 0.025), (0.02, 0.0, -np.sqrt(1.0 - 0.02**2)), yaw=0.3)
VIEWED = EDGE.object_from_gel[:3, :3] @ rotation_about(np.array([0.0, 1.0, 0.0]), np.radians(1.0))
"""As the estimator believes the tool stood: a degree off."""


@pytest.fixture(scope="module")
def block() -> RasterMesh:
    return RasterMesh(stepped_block())


@pytest.fixture
def view(block: RasterMesh) -> ToolView:
    """Along the tool; nothing asked for yet."""
    pitch = 0.5 * BLOCK * GELSIGHT_R15.pitch
    return view_along(partial(first_surface, block), block.mesh.vertices, VIEWED, pitch, GELSIGHT_R15)


@pytest.fixture(scope="module")
def reading(block: RasterMesh) -> TouchMap:
    """A press over the edge of the step, somewhat tilted: an edge, a slope and a level part."""
    heights = felt(block, EDGE)
    return touch_map(heights, GELSIGHT_R15.pitch, BLOCK, NOISE.skirt, NOISE.edge, 0.12e-3)


def cropped(view: ToolView, row: int, column: int, shape: tuple[int, int]) -> tuple[FloatArray, float]:
    """Depth at every second pixel, the map's centre on the pixel; inf beyond the picture."""
    reach = 2 * max(shape)
    padded = np.pad(view.depth, reach, constant_values=np.inf)
    top, left = row - (shape[0] - 1) + reach, column - (shape[1] - 1) + reach
    depth = padded[top : top + 2 * shape[0] : 2, left : left + 2 * shape[1] : 2]
    reference = float(depth.min())
    if not np.isfinite(reference):
        return np.full(shape, SUNKEN), reference
    return np.maximum(SUNKEN, reference - depth), reference


def blurred(image: FloatArray, half: FloatArray) -> FloatArray:
    kernel = np.r_[half[:0:-1], half]
    once = correlate1d(image, kernel, axis=1, mode="nearest")
    return np.asarray(correlate1d(once, kernel, axis=0, mode="nearest"))


def hung(pressed: FloatArray, touch: TouchMap) -> FloatArray:
    """Taxim's construction with one skirt: blur, put back what is deep, soften the edges."""
    core = pressed > CORE * pressed.max()
    return blurred(np.where(core, pressed, blurred(pressed, touch.skirt)), touch.edge)


def places(touch: TouchMap) -> tuple[FloatArray, FloatArray]:
    rows, columns = touch.heights.shape
    y, x = (np.arange(side) + 0.5 - 0.5 * side for side in (rows, columns))
    return np.meshgrid(x * touch.pitch, y * touch.pitch)


def plane_of(gap: FloatArray, where: BoolArray, touch: TouchMap, before: FloatArray) -> FloatArray:
    """``before`` plus the least-squares plane of ``gap``, the tilts of the sum held to zero by the prior."""
    x, y = places(touch)
    design = np.column_stack([np.ones(where.sum()), x[where], y[where]])
    ridge = where.sum() * (NOISE.rms / NOISE.tilt) ** 2 * np.diag([0.0, 1.0, 1.0])
    right = design.T @ gap[where] - ridge @ before
    return np.asarray(before + np.linalg.solve(design.T @ design + ridge, right))


def pressed_by(crop: FloatArray, plane: FloatArray, touch: TouchMap) -> FloatArray:
    x, y = places(touch)
    return np.asarray(np.maximum(0.0, crop - plane[0] - plane[1] * x - plane[2] * y))


def cost_of(predicted: FloatArray, plane: FloatArray, touch: TouchMap) -> float:
    gap = np.abs(predicted - touch.heights)
    gap = np.where(touch.flat, np.minimum(gap, predicted), gap)
    tilt = (plane[1] ** 2 + plane[2] ** 2) / NOISE.tilt**2
    return float((gap**2).sum() / (len(touch.touched) * NOISE.rms**2) + tilt)


def slid(predicted: FloatArray, touch: TouchMap) -> float:
    """By how much a shift within a pixel and a turn in the picture's plane lower the cost, by a ridge fit."""
    rows, columns = touch.heights.shape
    down, across = np.zeros((2, rows, columns))
    down[1:-1] = 0.5 * (predicted[2:] - predicted[:-2])
    across[:, 1:-1] = 0.5 * (predicted[:, 2:] - predicted[:, :-2])
    y, x = np.meshgrid(*(np.arange(side) + 0.5 - 0.5 * side for side in (rows, columns)), indexing="ij")
    inner = ~touch.flat
    inner[[0, -1]], inner[:, [0, -1]] = False, False
    design = np.column_stack([across[inner], down[inner], (x * down - y * across)[inner]])
    unit = len(touch.touched) * NOISE.rms**2
    gap = (touch.heights - predicted)[inner]
    prior = np.diag([WITHIN**-2, WITHIN**-2, NOISE.spin**-2])
    right = design.T @ gap / unit
    step = np.linalg.solve(design.T @ design / unit + prior, right)
    share = min(1.0, 1.0 / max(*np.abs(step[:2]), 1e-9))
    return float(share * (2.0 - share) * right @ step)


def reference(view: ToolView, row: int, column: int, touch: TouchMap) -> tuple[float, float]:
    """The term at one pixel and the depth of the gel's centre."""
    crop, first = cropped(view, row, column, touch.heights.shape)
    if not np.isfinite(first):
        return -np.inf, np.nan
    sure = np.zeros(touch.heights.shape, np.bool_)
    sure[tuple(touch.touched.T)] = True
    plane = plane_of(crop - touch.heights, sure, touch, np.zeros(3))
    predicted = hung(shape := pressed_by(crop, plane, touch), touch)
    if (cost := cost_of(predicted, plane, touch)) < 150.0 and (shape > 0.0).any():
        plane = plane_of(predicted - touch.heights, shape > 0.0, touch, plane)
        predicted = hung(pressed_by(crop, plane, touch), touch)
        cost = cost_of(predicted, plane, touch)
    cost -= slid(predicted, touch)
    return -0.5 * cost, first - float(plane[0])


def some_pixels(view: ToolView, count: int, seed: int = 0) -> IntArray:
    """Half of them anywhere, half where the press was."""
    rng = np.random.default_rng(seed)
    near = np.round((np.array(EDGE.point) @ view.object_from_view)[:2] - view.origin, 9) / view.pitch
    anywhere = np.column_stack([rng.integers(0, side, count // 2) for side in view.depth.shape])
    there = near[::-1].astype(np.int64) + rng.integers(-3, 4, (count - count // 2, 2))
    return np.vstack([anywhere, there])


def test_scores_are_those_of_the_plain_reference(view: ToolView, reading: TouchMap) -> None:
    pixels = some_pixels(view, 150)
    view_scores(view, reading, NOISE, pixels)
    expected = np.array([reference(view, int(r), int(c), reading) for r, c in pixels])
    assert np.isfinite(expected[:, 0]).sum() > 100
    assert view.score[tuple(pixels.T)] == pytest.approx(expected[:, 0], rel=1e-6, abs=1e-6)
    assert view.gel_depth[tuple(pixels.T)] == pytest.approx(expected[:, 1], abs=1e-9, nan_ok=True)


def test_only_the_pixels_asked_for_are_filled_in_and_each_once(view: ToolView, reading: TouchMap) -> None:
    pixels = some_pixels(view, 20)
    view_scores(view, reading, NOISE, pixels)
    filled = np.zeros(view.score.shape, np.bool_)
    filled[tuple(pixels.T)] = True
    np.testing.assert_array_equal(np.isnan(view.score), ~filled)
    mark = tuple(pixels[0])
    view.score[mark] = 123.0
    view_scores(view, reading, NOISE, pixels)
    assert view.score[mark] == 123.0


def test_single_precision_gives_the_same_term_to_its_own_digits(view: ToolView, reading: TouchMap) -> None:
    """The least-squares plane is solved by determinants: they must not lose what float32 keeps."""
    pixels = some_pixels(view, 100)
    view_scores(view, reading, NOISE, pixels)
    # float32 carries a depth of 25 mm to 2 nm, a reading of 1 mm to 0.1 nm.
    rough = TouchMap(
        read_only(reading.heights.astype(np.float32).astype(np.float64)),
        reading.pitch,
        reading.touched,
        reading.flat,
        reading.skirt,
        reading.edge,
    )
    depth = read_only(view.depth.astype(np.float32).astype(np.float64))
    again = ToolView(
        view.object_from_view,
        view.origin,
        view.pitch,
        depth,
        view.nearest,
        view.farthest,
        np.full(depth.shape, np.nan),
        np.full(depth.shape, np.nan),
        np.empty_like(view.lean),
    )
    view_scores(again, rough, NOISE, pixels)
    here, there = view.score[tuple(pixels.T)], again.score[tuple(pixels.T)]
    # What counts: terms that are not capped anyway.
    counts = here > -75.0
    assert counts.sum() > 20
    assert there[counts] == pytest.approx(here[counts], abs=0.02)


def term_of(
    view: ToolView,
    touch: TouchMap,
    place: FloatArray,
    step: int,
    rings: int,
    shift: float,
    temperature: float,
) -> float:
    """The mixture over cells around one place, written out."""
    column, row = (place[:2] - view.origin) / view.pitch
    middle = step * np.round(np.array([row, column]) / step).astype(np.int64)
    values, spread = [], 0.0
    for u in range(-rings, rings + 1):
        for v in range(-rings, rings + 1):
            r, c = middle + step * np.array([u, v])
            spread += np.exp(-0.5 * (u * u + v * v) * (step * view.pitch / shift) ** 2)
            if not (0 <= r < view.depth.shape[0] and 0 <= c < view.depth.shape[1]):
                continue
            if not view.nearest[r // POOL, c // POOL] < place[2] < view.farthest[r // POOL, c // POOL]:
                continue
            score, depth = reference(view, int(r), int(c), touch)
            off = view.pitch * np.hypot(c - column, r - row)
            values.append(
                temperature * score - 0.5 * ((off / shift) ** 2 + ((place[2] - depth) / NOISE.depth) ** 2)
            )
    seen = [value for value in values if np.isfinite(value)]
    total = np.logaddexp.reduce(seen) - np.log(spread) if seen else -np.inf
    return float(np.logaddexp(total, -NOISE.cap))


@pytest.mark.parametrize(("step", "rings", "temperature"), [(1, 2, 0.3), (2, 2, 0.3), (2, 1, 1.0)])
def test_terms_are_the_mixture_over_the_cells_around_a_place(
    view: ToolView, reading: TouchMap, step: int, rings: int, temperature: float
) -> None:
    rng = np.random.default_rng(4)
    true = EDGE.object_from_gel[:3, 3] @ view.object_from_view
    where = true + rng.normal(size=(40, 3)) * np.array([1e-3, 1e-3, 0.5e-3])
    where[30:] += np.array([0.05, 0.05, 0.0]) * rng.uniform(-1.0, 1.0, (10, 3))
    found = touch_terms(view, reading, NOISE, where, step, rings, 0.7e-3, temperature)
    expected = [term_of(view, reading, place, step, rings, 0.7e-3, temperature) for place in where]
    assert found == pytest.approx(expected, abs=1e-6)
    assert (found > -0.5 * NOISE.cap).any()
    assert (found < -0.99 * NOISE.cap).any()


def test_similarities_are_the_cosines_of_the_two_maps(view: ToolView, reading: TouchMap) -> None:
    pixels = some_pixels(view, 80, seed=2)
    depth = view.depth[tuple(pixels.T)]
    pixels, depth = pixels[np.isfinite(depth)], depth[np.isfinite(depth)]
    where = np.column_stack([view.origin + pixels[:, ::-1] * view.pitch, depth])
    expected = []
    for row, column in pixels:
        crop, _ = cropped(view, int(row), int(column), reading.heights.shape)
        shape = hung(np.maximum(0.0, crop - crop.max() + reading.heights.max()), reading)
        both = np.linalg.norm(shape) * np.linalg.norm(reading.heights)
        expected.append(float((shape * reading.heights).sum() / both))
    found = touch_kernels.similarities_at(view.origin, view.pitch, view.depth, reading.reading, where, 1.5e-3)
    assert found == pytest.approx(expected, abs=1e-9)


def test_what_lies_behind_the_first_surface_or_beyond_the_picture_is_like_nothing(
    view: ToolView, reading: TouchMap
) -> None:
    rows, columns = view.depth.shape
    middle = np.array([columns // 2, rows // 2])
    front = np.r_[view.origin + view.pitch * middle, view.depth[middle[1], middle[0]]]
    behind, beside = front + 3e-3 * np.eye(3)[2], front + np.eye(3)[0]
    places = np.array([front, behind, beside])
    found = touch_kernels.similarities_at(
        view.origin, view.pitch, view.depth, reading.reading, places, 1.5e-3
    )
    assert found[0] > 0.0
    assert found[1] == found[2] == 0.0


@pytest.mark.parametrize("shape", [(15, 20), (16, 21), (1, 7)])
def test_blurring_is_the_convolution_with_its_edge_pixels_repeated(shape: tuple[int, int]) -> None:
    rng = np.random.default_rng(0)
    image, half = rng.random(shape), np.array([0.4, 0.2, 0.1])
    expected = blurred(image, half)
    touch_kernels._blur(image, half, np.empty(shape))
    assert image == pytest.approx(expected, abs=1e-15)


def test_blurring_keeps_a_level_and_the_mean_of_what_does_not_reach_the_edge() -> None:
    half = np.array([0.4, 0.2, 0.1])
    level, spot = np.full((9, 11), 0.7), np.zeros((9, 11))
    spot[4, 5] = 1.0
    for image in (level, spot):
        total = image.sum()
        touch_kernels._blur(image, half, np.empty(image.shape))
        assert image.sum() == pytest.approx(total)
    assert level == pytest.approx(0.7)
