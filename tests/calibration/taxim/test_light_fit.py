"""Skirt and light from ball presses: what is recovered of a drawn gel, and laws of the ball's profile."""

from itertools import pairwise

import numpy as np
import pytest

from calibration.taxim.light_fit import (
    REACH,
    GelLight,
    ball_profile,
    depth_of,
    fit_light,
    light_shades,
    pressed_ball,
    skirt_of,
)
from calibration.taxim.pictures import PressPack
from calibration.taxim.smooth_fit import distance
from harness.basics.arrays import FloatArray
from harness.basics.errors import CalibrationRefused
from harness.sim.gel.gel import GelSkirt, deform
from harness.sim.optics.shading import design, scaled_position, softly_limited
from harness.sim.optics.tactile_calibration import smooth_terms
from tests.samples.drawn_presses import BALL, COLUMNS, CONTACT, ROWS, spread_centres

TRUE = skirt_of(4.0 * CONTACT, 0.5)
DIMMING = np.array([-2.0, -3.5, -1.5])
"""Grey levels a pixel of indentation."""


def _drawn(skirt: GelSkirt, count: int = 20) -> tuple[PressPack, FloatArray, FloatArray]:
    """Presses by a known gel: colours that go with the slope, and dimming that goes with the depth."""
    smooth = np.zeros((smooth_terms(), 3))
    smooth[0], smooth[30] = (60.0, -30.0, -40.0), (10.0, 70.0, -75.0)  # first powers of y and of x
    y, x = (axis.ravel().astype(float) for axis in np.mgrid[:ROWS, :COLUMNS])
    where, centres = scaled_position(x, y, ROWS, COLUMNS), spread_centres(count)
    change = np.empty((count, ROWS, COLUMNS, 3))
    noise = np.random.default_rng(3)
    for k, centre in enumerate(centres):
        reached = pressed_ball(distance((ROWS, COLUMNS), centre), depth_of(skirt, CONTACT, BALL), BALL)
        surface = deform(reached[None], skirt)[0]
        down, right = (np.pad(np.gradient(surface)[axis][1:-1, 1:-1], 1, mode="edge") for axis in (0, 1))
        steep = np.hypot(down, right)
        bent = np.vectorize(softly_limited)(steep / np.hypot(1.0, steep), CONTACT / BALL)
        normal = -np.stack([right, down], axis=-1) * (bent / np.maximum(steep, 1e-12))[..., None]
        shades = design(normal.reshape(-1, 2), where) @ smooth + surface.reshape(-1, 1) * DIMMING
        change[k] = shades.reshape(ROWS, COLUMNS, 3) + noise.normal(0.0, 1.0, (ROWS, COLUMNS, 3))
    background = np.full((ROWS, COLUMNS, 3), 128, np.uint8)
    images = np.clip(np.rint(background + change), 0, 255).astype(np.uint8)
    pack = PressPack(background, images, centres, np.full(count, CONTACT), np.arange(count), "0" * 64)
    return pack, change, centres


@pytest.fixture(scope="module")
def fitted() -> tuple[PressPack, FloatArray, FloatArray, GelLight]:
    pack, change, centres = _drawn(TRUE)
    some = np.arange(1, 20)
    light = fit_light(pack.of(some), change[some], centres[some], CONTACT, BALL)
    return pack, change, centres, light


def test_the_skirt_is_found_again(fitted: tuple[PressPack, FloatArray, FloatArray, GelLight]) -> None:
    light = fitted[3]
    assert light.skirt.kernels[0] == pytest.approx(TRUE.kernels[0], rel=0.35)
    assert light.skirt.core == pytest.approx(TRUE.core, abs=0.051)
    assert light.depth == pytest.approx(depth_of(TRUE, CONTACT, BALL), rel=0.15)


def test_a_press_left_out_is_drawn_to_the_noise_over_the_whole_frame(
    fitted: tuple[PressPack, FloatArray, FloatArray, GelLight],
) -> None:
    pack, change, centres, light = fitted
    place = np.argwhere(np.ones(pack.shape, np.bool_))
    left = light_shades(pack, light, centres[0], place) - change[0].reshape(-1, 3)
    off_line = np.abs(distance(pack.shape, centres[0]).ravel() - CONTACT) > 0.6 * CONTACT
    # The noise is one. The gel follows the object in whole pixels, so that its line is jagged by half of one.
    assert np.sqrt(np.mean(left[off_line] ** 2)) < 1.1
    assert np.sqrt(np.mean(left**2)) < 1.5
    assert np.sqrt(np.mean(change[0] ** 2)) > 4.0 * np.sqrt(np.mean(left**2))


def test_what_dims_a_flat_gel_is_found_at_its_apex(
    fitted: tuple[PressPack, FloatArray, FloatArray, GelLight],
) -> None:
    pack, _, _, light = fitted
    centre = np.array([60.0, 50.0])
    apex = light_shades(pack, light, centre, np.array([[50, 60]]))[0]
    height = ball_profile(TRUE, CONTACT, BALL, "exact").height[0]
    assert apex == pytest.approx(DIMMING * height, abs=1.0)


def test_a_narrower_skirt_is_told_from_a_wide_one() -> None:
    widest = []
    for width in (1.5, 6.0):
        pack, change, centres = _drawn(skirt_of(width * CONTACT, 0.5))
        widest.append(fit_light(pack, change, centres, CONTACT, BALL).skirt.kernels[0])
    assert widest[0] < 2.5 * CONTACT < 4.0 * CONTACT < widest[1]


def test_the_profile_is_the_gels_along_a_row() -> None:
    size = 120
    away = distance((2 * size + 1, 2 * size + 1), np.array([size, size], dtype=float))
    surface = deform(pressed_ball(away, depth_of(TRUE, CONTACT, BALL), BALL)[None], TRUE)[0]
    profile = ball_profile(TRUE, CONTACT, BALL, "exact")
    reach = int(REACH * CONTACT)
    assert profile.height[:reach] == pytest.approx(surface[size, size : size + reach])
    slope = (surface[size, size - 1 : size + reach - 1] - surface[size, size + 1 : size + reach + 1]) / 2.0
    assert profile.sine[:reach] == pytest.approx(slope / np.hypot(1.0, slope), abs=1e-9)


def test_a_ball_shapes_the_gel_out_to_its_contact_line() -> None:
    """What is deeper than the core's share of the deepest lies within the line, by definition."""
    for core in (0.2, 0.5, 0.7):
        skirt = GelSkirt(TRUE.kernels, core=core)
        away = np.linspace(0.0, 2.0 * BALL, 2000)
        depth = depth_of(skirt, CONTACT, BALL)
        reached = pressed_ball(away, depth, BALL)
        assert away[reached > core * depth].max() == pytest.approx(CONTACT, abs=0.02)
        assert reached[0] == pytest.approx(depth)
        assert not reached[away >= BALL].any()


@pytest.mark.parametrize("widest", [2.0, 5.0, 27.0, 88.0])
def test_pyramids_halve_odd_widths(widest: float) -> None:
    kernels = skirt_of(widest, 0.4).kernels
    assert all(kernel % 2 == 1 and kernel >= 5 for kernel in kernels)
    assert all(2 * b - 1 <= a <= 2 * b + 3 for a, b in pairwise(kernels))


def test_a_contact_as_large_as_the_ball_is_refused() -> None:
    pack, change, centres = _drawn(TRUE, 2)
    with pytest.raises(CalibrationRefused, match=r"12\.0 px.*12\.0 px"):
        fit_light(pack, change, centres, BALL, BALL)
