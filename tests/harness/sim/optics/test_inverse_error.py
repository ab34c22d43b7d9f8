"""The error stated of a height: against noise drawn anew, against surfaces known exactly, and its laws."""

from dataclasses import replace

import numpy as np
import pytest

from harness.basics.arrays import ByteArray, FloatArray
from harness.basics.errors import DataRefused
from harness.sim.gel.gel import R15_SKIRT, deform
from harness.sim.optics.contact_depth import Depth, read_depth
from harness.sim.optics.depth_reading import ColourError, height_errors
from harness.sim.optics.optics import Optics
from harness.sim.optics.tactile_calibration import ColourMisfit, TactileCalibration, shipped_calibration
from tests.samples.ball_depth import sigma_without
from tests.samples.smooth_colours import SmoothColours

PITCH = 0.1245e-3
CAMERA = 1.5
PLACES = ((55, 70, 8e-3), (70, 60, 4e-3), (60, 80, 20e-3), (60, 158, 5e-3))
"""Row, column and radius of balls: a usual one, a small, a large, one at the border."""

MISFIT = ColourError(camera=0.0, share=0.4, dimming=0.0, draws=8)


@pytest.fixture(scope="module")
def bench() -> TactileCalibration:
    return shipped_calibration("gelsight_r15_bench")


@pytest.fixture(scope="module")
def gel() -> FloatArray:
    """A millimetre of each ball, a roof over the window, and a roller."""
    y, x = np.mgrid[:120, :160] * PITCH
    presses = [_cap((y - i * PITCH) ** 2 + (x - j * PITCH) ** 2, radius) for i, j, radius in PLACES]
    across = (x - 80 * PITCH) * np.cos(0.4) + (y - 60 * PITCH) * np.sin(0.4)
    presses += [np.maximum(0.0, 1e-3 - np.abs(across) * np.tan(0.6)), _cap(across**2, 6e-3)]
    return deform(np.stack(presses), R15_SKIRT)


@pytest.fixture(scope="module")
def images(gel: FloatArray) -> ByteArray:
    clean = Optics(shipped_calibration("gelsight_r15_world"), "exact").render(gel).images
    return _noisy(clean, 3)


@pytest.fixture(scope="module")
def depth(images: ByteArray, bench: TactileCalibration) -> Depth:
    return read_depth(images, bench)


def _cap(squared: FloatArray, radius: float) -> FloatArray:
    return np.asarray(np.maximum(0.0, 1e-3 - radius + np.sqrt(np.maximum(radius**2 - squared, 0.0))))


def _noisy(clean: ByteArray, seed: int) -> ByteArray:
    noise = np.random.default_rng(seed).normal(0.0, CAMERA, clean.shape)
    return np.clip(np.rint(clean + noise), 0.0, 255.0).astype(np.uint8)


def test_two_thirds_lie_within_one_deviation_and_nearly_all_within_two(
    gel: FloatArray, images: ByteArray, depth: Depth
) -> None:
    """Drawn by one calibration of a sensor, read by another made of other presses."""
    stated = height_errors(images, depth)
    scores = np.concatenate(
        [
            (np.abs(depth.read.height[k] - gel[k]) / stated[k].sigma)[depth.read.imprint[k]]
            for k in range(len(gel))
        ]
    )
    assert 0.60 < (scores < 1.0).mean() < 0.90
    assert (scores < 2.0).mean() > 0.93


def test_deviations_hold_a_smooth_misfit_that_the_calibration_states(
    bench: TactileCalibration, gel: FloatArray
) -> None:
    """Tables wrong by a smooth function of the normal, another in each picture, as presses left out are."""
    balls = np.repeat(gel[:3], 2, axis=0)
    images = _off_by(Optics(bench, "smooth").render(balls).images, balls, 9.0, 0.2)
    plain = read_depth(images, bench)
    known = [
        replace(by, header=replace(by.header, misfit=ColourMisfit(9.0, 0.2))) for by in plain.calibrations
    ]
    within = {}
    for states, depth in ((False, plain), (True, replace(plain, calibrations=tuple(known)))):
        errors = height_errors(images, depth, ColourError(draws=16))
        scores = [
            (np.abs(depth.read.height[k] - balls[k]) / errors[k].sigma)[balls[k] > 0.3e-3]
            for k in range(len(balls))
        ]
        within[states] = np.mean(np.concatenate(scores) < [[1.0], [2.0]], axis=1)
    assert (within[True] > (0.60, 0.90)).all(), within
    assert (within[False] < within[True] - 0.1).all(), within


def _off_by(images: ByteArray, gel: FloatArray, rms: float, alike: float) -> ByteArray:
    """The same pictures with colours that are off where the gel is not at rest."""
    moved = images.astype(np.float64)
    for k, heights in enumerate(gel):
        down, right = np.gradient(heights / PITCH)
        normal = -np.stack([right, down], axis=-1) / np.sqrt(1.0 + right**2 + down**2)[..., None]
        let_in = np.minimum(1.0, heights / 0.1e-3)[..., None]
        moved[k] += rms * let_in * SmoothColours(alike, seed=k).at(normal)
    return np.clip(np.rint(moved), 0.0, 255.0).astype(np.uint8)


def test_what_the_cameras_noise_does_is_what_is_stated(bench: TactileCalibration, gel: FloatArray) -> None:
    clean = Optics(bench, "smooth").render(gel[:1]).images
    taken = np.concatenate([_noisy(clean, seed) for seed in range(16)])
    depths = read_depth(taken, bench)
    inside = depths.read.imprint.all(axis=0) & (gel[0] > 0.3e-3)
    seen = depths.read.height.std(axis=0)[inside]
    noise = ColourError(camera=CAMERA, share=0.0, dimming=0.0, draws=32)
    stated = np.sqrt(np.mean(height_errors(taken[:1], _one_of(depths, 0), noise)[0].draws ** 2, axis=0))
    ratio = np.sqrt(np.mean(stated[inside] ** 2) / np.mean(seen**2))
    assert 0.6 < ratio < 1.6


def _one_of(depths: Depth, k: int) -> Depth:
    """One of several readings."""
    read = depths.read
    names = ("height", "contact", "imprint", "trusted", "error", "anchored")
    one = type(read)(**{name: vars(read)[name][k : k + 1] for name in names}, seconds=read.seconds)
    return Depth(one, depths.calibrations[k : k + 1], depths.dimming[k : k + 1], depths.drift[k : k + 1])


def test_twice_the_misfit_is_twice_the_error(images: ByteArray, depth: Depth) -> None:
    one = _one_of(depth, 0)
    small = height_errors(images[:1], one, MISFIT)[0].draws
    double = ColourError(camera=0.0, share=0.8, dimming=0.0, draws=8)
    large = height_errors(images[:1], one, double)[0].draws
    # Where a slope was held, and where dirt was seen, the error is not the misfit's; both are rare here.
    assert np.median(np.abs(large).max(axis=0)) == pytest.approx(
        2.0 * np.median(np.abs(small).max(axis=0)), rel=0.1
    )


def test_the_same_seed_gives_the_same_error_and_rest_only_the_floor(images: ByteArray, depth: Depth) -> None:
    one = _one_of(depth, 1)
    first, again, other = (height_errors(images[1:2], one, MISFIT, seed)[0] for seed in (4, 4, 5))
    assert np.array_equal(first.draws, again.draws)
    assert not np.array_equal(first.draws, other.draws)
    far = np.zeros(first.sigma.shape, np.bool_)
    far[:6, -6:] = True
    assert not depth.read.imprint[1][far].any()
    assert first.sigma[far] == pytest.approx(first.floor)
    assert first.sigma[depth.read.contact[1]].min() > first.floor


def test_what_is_fitted_away_leaves_less(images: ByteArray, depth: Depth) -> None:
    errors = height_errors(images[:1], _one_of(depth, 0), MISFIT)[0]
    inside = depth.read.contact[0]
    left = sigma_without(errors, np.ones((int(inside.sum()), 1)), inside)
    assert np.mean(left**2) <= np.mean(errors.sigma[inside] ** 2)
    nothing = sigma_without(errors, np.empty((int(inside.sum()), 0)), inside)
    assert nothing == pytest.approx(errors.sigma[inside])


def test_no_contact_has_only_the_floor(bench: TactileCalibration) -> None:
    untouched = bench.background[None]
    errors = height_errors(untouched, read_depth(untouched, bench), MISFIT)[0]
    assert not errors.draws.any()
    assert errors.sigma == pytest.approx(0.05 * PITCH)


def test_what_makes_no_sense_is_refused(images: ByteArray, depth: Depth) -> None:
    with pytest.raises(DataRefused, match=r"images are \(2, "):
        height_errors(images[:2], depth)
    with pytest.raises(DataRefused, match=r"\b1 draws"):
        height_errors(images, depth, ColourError(draws=1))
