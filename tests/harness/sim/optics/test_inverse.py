"""Image to height map: rendered under one calibration, read under another, and real presses."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from calibration.taxim.pictures import read_pack
from harness.basics.arrays import FloatArray
from harness.basics.errors import CalibrationRefused, DataRefused
from harness.sim.gel.gel import R15_SKIRT, deform
from harness.sim.optics.inverse import DRIFTING, Detection, invert
from harness.sim.optics.optics import Optics
from harness.sim.optics.poisson import anchored_heights, free_heights
from harness.sim.optics.tactile_calibration import TactileCalibration, shipped_calibration

PITCH = 0.1245e-3
DEPTH = 1e-3


@pytest.fixture(scope="module")
def world() -> TactileCalibration:
    return shipped_calibration("gelsight_r15_world")


@pytest.fixture(scope="module")
def bench() -> TactileCalibration:
    return shipped_calibration("gelsight_r15_bench")


def _coordinates(i: float, j: float) -> tuple[FloatArray, FloatArray]:
    y, x = np.mgrid[:120, :160] - np.array([i, j])[:, None, None]
    return y * PITCH, x * PITCH


def _ball(i: float, j: float, radius: float, depth: float = DEPTH) -> FloatArray:
    y, x = _coordinates(i, j)
    return np.asarray(np.maximum(0.0, depth - radius + np.sqrt(np.maximum(radius**2 - x * x - y * y, 0.0))))


def _cylinder(turn: float, radius: float) -> FloatArray:
    y, x = _coordinates(60, 80)
    across = x * np.cos(turn) + y * np.sin(turn)
    return np.asarray(np.maximum(0.0, DEPTH - radius + np.sqrt(np.maximum(radius**2 - across**2, 0.0))))


def _edge(turn: float, tilt: float) -> FloatArray:
    y, x = _coordinates(60, 80)
    across, along = x * np.cos(turn) + y * np.sin(turn), y * np.cos(turn) - x * np.sin(turn)
    return np.asarray(np.maximum(0.0, DEPTH - np.abs(across) * np.tan(0.6) + along * np.tan(tilt)))


SHAPES = {
    "ball 8 mm": _ball(55, 70, 8e-3),
    "ball 4 mm": _ball(70, 60, 4e-3),
    "ball 20 mm": _ball(60, 80, 20e-3),
    "ball at the border": _ball(60, 158, 5e-3),
    "cylinder": _cylinder(0.4, 6e-3),
    "edge": _edge(2.0, 0.05),
}


def _rms(error: FloatArray) -> float:
    return float(np.sqrt(np.mean(error**2)))


@pytest.mark.parametrize("shape", SHAPES)
def test_a_press_is_read_within_fifty_micrometres_under_another_calibration(
    shape: str, world: TactileCalibration, bench: TactileCalibration
) -> None:
    gel = deform(SHAPES[shape][None], R15_SKIRT)
    read = invert(Optics(world, "exact").render(gel).images, bench)
    assert _rms(read.height - gel) < 50e-6
    assert read.anchored.all()
    touched = gel > 2 * R15_SKIRT.core * gel.max()
    assert read.contact[touched].mean() > 0.97
    assert not read.contact[gel < 0.25 * R15_SKIRT.core * gel.max()].any()


def test_noise_of_the_camera_costs_little(world: TactileCalibration, bench: TactileCalibration) -> None:
    gel = deform(np.stack(list(SHAPES.values())), R15_SKIRT)
    clean = Optics(world, "exact").render(gel).images
    noise = np.random.default_rng(0).normal(0.0, 1.5, clean.shape)
    noisy = np.clip(np.rint(clean + noise), 0, 255).astype(np.uint8)
    assert _rms(invert(noisy, bench).height - invert(clean, bench).height) < 12e-6


def test_the_stated_error_holds_the_error(world: TactileCalibration, bench: TactileCalibration) -> None:
    gel = deform(np.stack(list(SHAPES.values())), R15_SKIRT)
    read = invert(Optics(world, "exact").render(gel).images, bench)
    inside = np.abs(read.height - gel)[read.imprint] / read.error[read.imprint]
    # One sigma of a Gaussian holds 68 %, two 95 %; calibrations err over whole regions alike.
    assert 0.5 < (inside < 1.0).mean() < 0.95
    assert (inside < 3.0).mean() > 0.9


def test_no_contact_is_nothing_at_all(bench: TactileCalibration) -> None:
    noise = np.random.default_rng(1).normal(0.0, 1.5, (3, *bench.background.shape))
    noisy = np.clip(np.rint(bench.background + noise), 0, 255).astype(np.uint8)
    read = invert(np.concatenate([bench.background[None], noisy]), bench)
    assert not read.height.any()
    assert not read.contact.any()
    assert not read.imprint.any()


def test_a_face_that_fills_the_window_is_read_up_to_its_level(
    world: TactileCalibration, bench: TactileCalibration
) -> None:
    y, x = _coordinates(60, 80)
    gel = deform((1.25e-3 + 0.08 * x + 0.05 * y)[None], R15_SKIRT)
    assert gel.min() > 0.0
    read = invert(Optics(world, "exact").render(gel).images, bench)
    assert not read.anchored[0]
    left = (read.height - gel)[0]
    assert _rms(left - left.mean()) < 60e-6


def test_dirt_is_not_trusted(world: TactileCalibration, bench: TactileCalibration) -> None:
    gel = deform(SHAPES["ball 8 mm"][None], R15_SKIRT)
    image = Optics(world, "exact").render(gel).images.copy()
    image[0, 50:54, 66:71] = 5
    read = invert(image, bench)
    assert not read.trusted[0, 51:53, 67:70].any()
    assert read.trusted[0].mean() > 0.95
    assert _rms(read.height - gel) < 80e-6


def test_real_presses_of_a_ball_are_read_as_its_cap(shared_data: Path, bench: TactileCalibration) -> None:
    """Presses that the bench's calibration never saw, against the sphere of 2 mm: shape, not depth."""
    pack = read_pack(shared_data / "tactile/objectfolder_calibs/dataPack.npz")
    read = invert(pack.images[::2], bench, DRIFTING)
    errors = []
    for height in read.height:
        weight = np.where(height > 0.6 * height.max(), height, 0.0)
        y, x = np.mgrid[:120, :160]
        i, j = (weight * y).sum() / weight.sum(), (weight * x).sum() / weight.sum()
        away = np.hypot(y - i, x - j) * PITCH
        cap = away < 1.45e-3  # the ball is followed to 1.56 mm from its centre
        left = height[cap] - np.sqrt(2e-3**2 - away[cap] ** 2)
        errors.append(_rms(left - left.mean()))
    assert np.median(errors) < 30e-6
    assert max(errors) < 50e-6


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_slopes_of_a_surface_give_it_back(seed: int) -> None:
    # Waves that the border reflects, long against a pixel: central differences are then nearly exact.
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:60, :80]
    surface = sum(
        rng.normal() * np.cos(np.pi * a * (y + 0.5) / 60) * np.cos(np.pi * b * (x + 0.5) / 80)
        for a in range(3)
        for b in range(3)
        if a + b
    )
    down, right = np.gradient(surface)
    free = free_heights(down, right)
    assert _rms(free - surface) < 0.01 * np.ptp(surface)


def test_anchored_heights_solve_the_weighted_least_squares() -> None:
    rng = np.random.default_rng(5)
    down, right = rng.normal(size=(2, 9, 11))
    weight = rng.uniform(0.1, 1.0, (9, 11))
    rest = rng.random((9, 11)) < 0.2
    heights = rng.normal(size=(9, 11))
    anchored_heights(heights, down, right, weight, rest)
    at = np.arange(99).reshape(9, 11)
    rows, wanted = [], []
    for slope, low, high in ((down, at[:-1], at[1:]), (right, at[:, :-1], at[:, 1:])):
        for p, q in zip(low.ravel(), high.ravel(), strict=True):
            pull = np.sqrt(min(weight.flat[p], weight.flat[q]))
            row = np.zeros(99)
            row[p], row[q] = -pull, pull
            rows.append(row)
            wanted.append(pull * 0.5 * (slope.flat[p] + slope.flat[q]))
    free = np.flatnonzero(~rest.ravel())
    best = np.zeros(99)
    best[free] = np.linalg.lstsq(np.array(rows)[:, free], np.array(wanted), rcond=None)[0]
    assert np.abs(heights.ravel() - best).max() < 0.01


def test_what_cannot_be_read_is_refused(bench: TactileCalibration) -> None:
    with pytest.raises(DataRefused, match="uint8"):
        invert(bench.background[None].astype(np.int64).view(np.uint8), bench)
    with pytest.raises(DataRefused, match="uint8"):
        invert(bench.background, bench)
    table_only = TactileCalibration(
        bench.header, bench.background, bench.table, bench.support, np.empty((0, 3))
    )
    with pytest.raises(CalibrationRefused, match="smooth"):
        invert(bench.background[None], table_only)


def test_a_contact_is_seen_from_the_threshold_on(
    world: TactileCalibration, bench: TactileCalibration
) -> None:
    image = Optics(world, "exact").render(deform(SHAPES["ball 20 mm"][None], R15_SKIRT)).images
    assert invert(image, bench).contact.any()
    assert not invert(image, bench, Detection(strong=300.0, wide=300.0)).contact.any()
