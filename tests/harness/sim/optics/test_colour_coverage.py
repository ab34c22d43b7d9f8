"""What a picture owes to presses and what to the fit between them."""

from dataclasses import replace

import numpy as np
import pytest

from harness.basics.arrays import FloatArray
from harness.sim.optics.lit_calibration import LitCalibration
from harness.sim.optics.optics import colour_error, filled_share
from harness.sim.optics.tactile_calibration import shipped_calibration

WORLD = shipped_calibration("gelsight_r15_world")
PITCH = WORLD.header.pitch


def plane(slope: float, direction: float) -> FloatArray:
    """``(120, 160)`` metres, climbing towards ``direction`` from the columns to the rows."""
    y, x = np.mgrid[:120, :160] * PITCH
    return np.asarray(np.tan(slope) * (x * np.cos(direction) + y * np.sin(direction)))


def test_a_plane_counts_as_its_bin_says() -> None:
    step, around = 0.5 * np.pi / 119, 2.0 * np.pi / 119
    for row, column in np.argwhere(np.ones((60, 119)))[::97]:
        share = filled_share(plane((row + 0.5) * step, (column + 0.5) * around - np.pi), WORLD)
        assert share == (0.0 if WORLD.support[row, column] else 1.0)


def test_of_two_planes_each_counts_by_its_pixels() -> None:
    support = np.zeros_like(WORLD.support)
    support[:, :60] = True  # towards -y alone
    known = replace(WORLD, support=support)
    roof = np.concatenate([plane(0.3, -1.0)[:, :40], plane(0.3, 1.0)[:, 40:]], axis=1)
    # 158 columns have a slope; two of them have a half from each plane.
    assert filled_share(roof, known) == pytest.approx(1.0 - 39.0 / 158.0, abs=2.1 / 158.0)


def test_what_has_no_slope_or_is_steeper_than_any_press_is_not_counted() -> None:
    nowhere = replace(WORLD, support=np.zeros_like(WORLD.support))
    assert filled_share(np.full((120, 160), 1e-3), nowhere) == 0.0
    assert filled_share(plane(1.2, 0.3), nowhere) == 0.0
    assert filled_share(plane(0.3, 0.3), nowhere) == 1.0


def test_the_sign_of_nothing_chooses_no_bin() -> None:
    """A slope of nothing along y beside one towards -x lies on the seam, whichever sign it has."""
    support = np.zeros_like(WORLD.support)
    support[:, -1] = True
    known = replace(WORLD, support=support)
    for nothing in (0.0, -0.0):
        surface = np.zeros((3, 3))
        surface[1, 0], surface[2, 1] = 0.6 * PITCH, nothing
        assert filled_share(surface, known) == 0.0


def test_a_published_table_does_not_say() -> None:
    silent = replace(WORLD, header=replace(WORLD.header, slope_limit=1.0))
    assert filled_share(plane(0.3, 0.3), silent) is None


def unsure(uncertainty: FloatArray) -> LitCalibration:
    """The world's calibration with errors of its colours, and no light of a press."""
    parts = {name: vars(WORLD)[name] for name in ("header", "background", "table", "support", "smooth")}
    lit = np.concatenate([WORLD.smooth, np.zeros((36, 3))])
    return LitCalibration(**parts, lit=lit, uncertainty=uncertainty.astype(np.float32))


def test_a_plane_s_colour_is_as_uncertain_as_its_bin() -> None:
    step, around = 0.5 * np.pi / 119, 2.0 * np.pi / 119
    errors = np.random.default_rng(0).uniform(0.0, 20.0, (120, 120, 3))
    known = unsure(errors)
    for row, column in np.argwhere(np.ones((60, 119)))[::97]:
        found = colour_error(plane((row + 0.5) * step, (column + 0.5) * around - np.pi), known)
        assert found == pytest.approx(np.sqrt(np.mean(errors[row, column] ** 2)), rel=1e-6)


def test_of_two_planes_the_errors_are_taken_together() -> None:
    errors = np.zeros((120, 120, 3))
    errors[:, 60:] = 4.0
    roof = np.concatenate([plane(0.3, -1.0)[:, :40], plane(0.3, 1.0)[:, 40:]], axis=1)
    assert colour_error(roof, unsure(errors)) == pytest.approx(4.0 * np.sqrt(119.0 / 158.0), rel=0.01)


def test_what_no_colour_is_drawn_of_is_not_uncertain() -> None:
    known = unsure(np.full((120, 120, 3), 4.0))
    assert colour_error(np.full((120, 160), 1e-3), known) == 0.0
    assert colour_error(plane(1.2, 0.3), known) == 0.0


def test_a_calibration_without_errors_does_not_say() -> None:
    assert colour_error(plane(0.3, 0.3), WORLD) is None
    assert colour_error(plane(0.3, 0.3), unsure(np.empty((0, 0, 3)))) is None
