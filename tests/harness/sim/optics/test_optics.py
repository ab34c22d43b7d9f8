"""The optics: Taxim's published pictures, and what must hold of every level."""

import dataclasses
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.basics.arrays import FloatArray
from harness.basics.errors import CalibrationRefused, OutOfDomain
from harness.sim.gel.gel import R15_SKIRT, deform
from harness.sim.optics.kernels import arctangent, change_exactly, change_fast, padded, to_pixels
from harness.sim.optics.optics import Optics, OpticsLevel
from harness.sim.optics.shading import KNEE, design, scaled_position, softly_limited
from harness.sim.optics.tactile_calibration import TactileCalibration, shipped_calibration

LEVELS: tuple[OpticsLevel, ...] = ("exact", "fast", "smooth")


@pytest.fixture(scope="module")
def world() -> TactileCalibration:
    return shipped_calibration("gelsight_r15_world")


def _pressed(
    depth: float = 0.7e-3, radius: float = 3e-3, centre: tuple[float, float] = (60.0, 70.0)
) -> FloatArray:
    y, x = np.mgrid[:120, :160] - np.array(centre)[:, None, None]
    away2 = (x * x + y * y) * 0.1245e-3**2
    cap = depth - radius + np.sqrt(np.maximum(radius**2 - away2, 0.0))
    return np.asarray(deform(np.maximum(0.0, cap)[None], R15_SKIRT))


def _decibels(a: FloatArray, b: FloatArray) -> float:
    return float(10 * np.log10(255.0**2 / np.mean((a - b) ** 2)))


@pytest.mark.parametrize(("known", "wanted"), [("cylinder6", "square"), ("square", "cylinder6")])
def test_one_published_picture_predicts_the_other(shared_data: Path, known: str, wanted: str) -> None:
    """The background estimated from one published picture, the other's drawn on it: JPEG allows 49 dB."""
    taxim = shared_data / "tactile/taxim"
    with np.load(taxim / "gelsight_lab/polycalib.npz", allow_pickle=False) as published:
        table = np.stack([published[f"grad_{c}"] for c in "rgb"], axis=-1)  # named so, blue first
    single = padded(table.astype(np.float32))
    pictures, exact, fast = {}, {}, {}
    for name in (known, wanted):
        results = taxim / "published_results"
        pictures[name] = np.asarray(cv2.imread(str(results / f"{name}_sim.jpg")), dtype=np.float64)
        surface = np.load(results / f"{name}_height.npy").astype(np.float64)
        exact[name], wide = np.empty((480, 640, 3)), np.empty((480, 640, 4), np.float32)
        change_exactly(surface, table, exact[name])
        change_fast(surface.astype(np.float32), 125, single, wide)
        fast[name] = wide[..., :3].astype(np.float64)
    for change in (exact, fast):
        background = np.rint(pictures[known] - change[known])
        drawn = np.clip(np.rint(background + change[wanted]), 0, 255)
        assert _decibels(drawn, pictures[wanted]) >= 47.8
    assert _decibels(pictures[known], pictures[wanted]) < 31.0  # what drawing nothing new would score


def _as_published(surface: FloatArray, table: FloatArray) -> FloatArray:
    """Taxim's arithmetic in plain numpy, written from the paper's description."""
    a = np.zeros_like(surface)
    b = np.zeros_like(surface)
    a[1:-1, 1:-1] = (surface[2:, 1:-1] - surface[:-2, 1:-1]) / 2
    b[1:-1, 1:-1] = (surface[1:-1, 2:] - surface[1:-1, :-2]) / 2
    for slope in (a, b):
        slope[...] = np.pad(slope[1:-1, 1:-1], 1, mode="edge")
    bins = len(table)
    steep = np.hypot(a, b)
    direction = np.where(steep > 0, np.arctan2(a, b), 0.0)
    row = np.floor(np.arctan(steep) / (0.5 * np.pi / (bins - 1))).astype(int)
    column = np.floor((direction + np.pi) / (2 * np.pi / (bins - 1))).astype(int)
    y, x = np.mgrid[: surface.shape[0], : surface.shape[1]].astype(float)
    terms = np.stack([x * x, y * y, x * y, x, y, np.ones_like(x)], axis=-1)
    return np.asarray(np.einsum("ijt,ijtc->ijc", terms, table[row, column]))


def test_the_exact_level_is_the_published_arithmetic(world: TactileCalibration) -> None:
    table, surface = world.table.astype(np.float64), _pressed()[0] / 0.1245e-3
    change = np.empty((120, 160, 3))
    change_exactly(surface, table, change)
    assert np.abs(change - _as_published(surface, table)).max() < 1e-9


def test_fast_differs_from_exact_only_where_a_slope_lies_on_a_bins_edge(world: TactileCalibration) -> None:
    rng = np.random.default_rng(3)
    heights = np.concatenate(
        [
            _pressed(d, r, tuple(rng.uniform(30, 90, 2)))
            for d, r in rng.uniform(0.3, 1, (20, 2)) * [1e-3, 6e-3]
        ]
    )
    exact, fast = (Optics(world, level).render(heights).images.astype(int) for level in ("exact", "fast"))
    assert (np.abs(exact - fast).max(axis=-1) > 1).mean() <= 2e-4


@pytest.mark.parametrize("bins", [120, 125])
def test_faces_along_an_axis_are_drawn_alike_by_exact_and_fast(world: TactileCalibration, bins: int) -> None:
    """Their directions lie on borders of a table of 125 bins, and one of them on any table's seam.

    Rounding, of the size that a mesh far from its origin leaves, may not choose the side.
    """
    rng = np.random.default_rng(7)
    jumpy = np.zeros((bins, bins, 6, 3), np.float32)
    jumpy[..., 5, :] = rng.uniform(-30.0, 30.0, (bins, bins, 1))
    jumpy[:, -1] = jumpy[:, 0]
    support, grey = np.ones((bins, bins), np.bool_), np.full_like(world.background, 128)
    table = dataclasses.replace(world, table=jumpy, support=support, background=grey)
    y, x = np.mgrid[:120, :160] * 0.1245e-3
    turns = [(0.0, 0.0), (0.1, 0.0), (-0.1, 0.0), (0.0, 0.1), (0.0, -0.1), (1.0, 0.0), (0.3, 0.3)]
    planes = np.stack([1e-3 + down * y + right * x for down, right in turns])
    noisy = planes + rng.normal(0.0, 1e-16, planes.shape)
    exact, fast = (Optics(table, level).render(noisy).images.astype(int) for level in ("exact", "fast"))
    assert (np.abs(exact - fast).max(axis=-1) > 1).mean() <= 2e-4
    assert (exact[:6] == exact[:6, :1, :1]).all()


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("shape", ["flat", "dome"])
def test_no_contact_is_the_background_to_the_bit(
    world: TactileCalibration, level: OpticsLevel, shape: str
) -> None:
    y, x = np.mgrid[:120, :160] - np.array([59.5, 79.5])[:, None, None]
    dome = np.sqrt(28.43e-3**2 - (x * x + y * y) * 0.1245e-3**2)
    optics = Optics(world, level, rest=None if shape == "flat" else -dome)
    nothing = optics.render(np.zeros((2, 120, 160)))
    assert np.array_equal(nothing.images, np.stack([world.background] * 2))
    assert not nothing.extrapolated.any()


@pytest.mark.parametrize("level", LEVELS)
def test_far_from_a_contact_is_the_background_to_the_bit(
    world: TactileCalibration, level: OpticsLevel
) -> None:
    heights = _pressed(centre=(60.0, 40.0))
    drawn = Optics(world, level).render(heights).images[0]
    still = heights[0] == 0.0
    still[1:-1, 1:-1] &= still[:-2, 1:-1] & still[2:, 1:-1] & still[1:-1, :-2] & still[1:-1, 2:]
    still[[0, -1]] = still[:, [0, -1]] = False
    assert still.mean() > 0.5
    assert np.array_equal(drawn[still], world.background[still])
    assert not np.array_equal(drawn, world.background)


@pytest.mark.parametrize("level", LEVELS)
def test_a_batch_draws_as_its_members(world: TactileCalibration, level: OpticsLevel) -> None:
    optics = Optics(world, level)
    heights = np.concatenate([_pressed(0.3e-3), _pressed(0.9e-3)])
    both = optics.render(heights).images
    assert all(np.array_equal(optics.render(heights[k : k + 1]).images[0], both[k]) for k in range(2))


def test_the_sign_of_nothing_does_not_choose_the_side_of_the_seam() -> None:
    table = np.random.default_rng(0).normal(0, 30, (125, 125, 6, 3))
    drawn = []
    for nothing in (0.0, -0.0):
        surface = np.zeros((3, 3))
        surface[2, 1], surface[1, 0] = nothing, 1.0
        exact, fast = np.empty((3, 3, 3)), np.empty((3, 3, 4), np.float32)
        change_exactly(surface, table, exact)
        change_fast(surface.astype(np.float32), 125, padded(table.astype(np.float32)), fast)
        drawn.append((exact, fast))
    assert np.array_equal(drawn[0][0], drawn[1][0])
    assert np.array_equal(drawn[0][1], drawn[1][1])


def test_values_are_rounded_clipped_and_counted(world: TactileCalibration) -> None:
    white = np.full_like(world.background, 255)
    bright = dataclasses.replace(world, background=white)
    drawn = Optics(bright, "exact").render(_pressed())
    assert drawn.saturated[0] > 0
    change, surface = np.empty((120, 160, 3)), np.empty((120, 160))
    to_pixels(np.zeros((120, 160)), _pressed()[0], 1.0 / world.header.pitch, surface)
    change_exactly(surface, world.table.astype(np.float64), change)
    rest = np.empty_like(change)
    change_exactly(np.zeros((120, 160)), world.table.astype(np.float64), rest)
    value = np.rint(255.0 - rest + change)
    assert drawn.saturated[0] == np.count_nonzero((value < 0) | (value > 255))
    assert np.array_equal(drawn.images[0], np.clip(value, 0, 255))


def test_a_step_is_drawn_as_the_steepest_slope_known_and_counted(world: TactileCalibration) -> None:
    step = np.zeros((1, 120, 160))
    step[0, 40:80, 50:100] = 2e-3
    steeper = step * 2.0
    drawn = [Optics(world, "exact").render(heights) for heights in (step, steeper)]
    assert drawn[0].extrapolated[0] > 100
    assert np.array_equal(drawn[0].images, drawn[1].images)


@settings(max_examples=50, deadline=None)
@given(a=st.floats(0.0, 1.0), b=st.floats(0.0, 1.0), limit=st.floats(0.2, 1.0))
def test_the_soft_limit_is_increasing_continuous_and_never_beyond(a: float, b: float, limit: float) -> None:
    low, high = sorted((a, b))
    assert softly_limited(low, limit) <= softly_limited(high, limit) <= limit
    assert softly_limited(high, limit) - softly_limited(low, limit) <= high - low + 1e-12
    if high <= KNEE * limit:
        assert softly_limited(high, limit) == high


def test_the_smooth_kernel_is_the_polynomial_it_says(world: TactileCalibration) -> None:
    heights = _pressed(0.2e-3, 6e-3)
    z = heights[0] / 0.1245e-3
    a, b = (np.pad(np.gradient(z)[k][1:-1, 1:-1], 1, mode="edge") for k in (0, 1))
    normal = np.stack([-b, -a], axis=-1) / np.sqrt(1 + a * a + b * b)[..., None]
    assert np.hypot(*normal.reshape(-1, 2).T).max() < KNEE * world.header.slope_limit
    y, x = np.mgrid[:120, :160].astype(float)
    change = design(normal.reshape(-1, 2), scaled_position(x.ravel(), y.ravel(), 120, 160)) @ world.smooth
    wanted = np.clip(np.rint(world.background + change.reshape(120, 160, 3)), 0, 255)
    drawn = Optics(world, "smooth").render(heights).images[0]
    assert (drawn != wanted).mean() < 1e-4  # sums in another order may round another way


def test_the_arctangent_is_good_to_single_precision() -> None:
    t = np.linspace(0, 1, 4001, dtype=np.float32)
    assert max(abs(float(arctangent(v)) - np.arctan(float(v))) for v in t) < 2e-7


def test_what_cannot_be_drawn_is_refused(world: TactileCalibration) -> None:
    optics = Optics(world, "fast")
    with pytest.raises(OutOfDomain, match="120, 160"):
        optics.render(np.zeros((1, 120, 161)))
    with pytest.raises(OutOfDomain, match="contact 1"):
        optics.render(np.stack([np.zeros((120, 160)), np.full((120, 160), np.nan)]))
    only_table = dataclasses.replace(world, smooth=np.empty((0, 3)))
    with pytest.raises(CalibrationRefused, match="smooth"):
        Optics(only_table, "smooth")
    assert Optics(only_table, "exact").render(np.zeros((1, 120, 160))).images.shape == (1, 120, 160, 3)
    with pytest.raises(OutOfDomain, match="rest"):
        Optics(world, "fast", rest=np.zeros((2, 2)))
