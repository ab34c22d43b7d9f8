"""An outline's residual is a chi-square where camera and object are off as stated, and large where not."""

import numpy as np
import pytest
from scipy.stats import chi2, kstest

from harness.agreement.agreement import Residual
from harness.agreement.camera import OutlineNoise, OutlineView, outline_residuals
from harness.agreement.place_noise import POSITION
from harness.basics.arrays import BoolArray, FloatArray
from harness.basics.errors import DataRefused
from harness.basics.geometry import translation
from harness.bench.gap import USUAL
from harness.bench.station_file import load_station, station_path
from harness.objects.builtin import build
from harness.picture.outline import DIRECTIONS, SeenOutline

CAMERA = load_station(station_path("mock")).camera
PLACE = translation(np.array([-0.42, 0.0, 0.25]))
OPEN = np.zeros(DIRECTIONS, np.bool_)
NOISE = OutlineNoise()


@pytest.fixture(scope="module")
def view() -> OutlineView:
    assert CAMERA is not None
    return OutlineView(build("mug"), PLACE, CAMERA)


def sigmas() -> FloatArray:
    of, at = NOISE.camera, USUAL
    groups = [3 * [POSITION], [at.tilt, at.tilt, at.yaw, at.scale], 3 * [of.position], 3 * [of.rotation]]
    return np.array([*np.concatenate(groups), of.focal_length])


def compared(view: OutlineView, extents: FloatArray, hidden: BoolArray = OPEN) -> tuple[Residual, ...]:
    return outline_residuals(0, view, SeenOutline(extents, hidden), USUAL, NOISE)


@pytest.mark.slow  # many drawn cases of a statistic
def test_outlines_with_the_stated_errors_are_chi_squares(view: OutlineView) -> None:
    rng, found = np.random.default_rng(0), []
    for _ in range(150):
        extents = view.extents(sigmas() * rng.normal(size=14)) + NOISE.read * rng.normal(size=DIRECTIONS)
        found.append([(one.chi_square, one.dof) for one in compared(view, extents)])
    for part in np.moveaxis(np.array(found), 1, 0):
        assert kstest(part[:, 0], "chi2", args=(part[0, 1],)).pvalue > 1e-3


@pytest.mark.parametrize("shift", [(0.04, 0.0, 0.0), (0.0, 0.04, 0.0), (0.0, 0.0, 0.03)])
def test_an_object_that_stands_elsewhere_is_seen(view: OutlineView, shift: tuple[float, ...]) -> None:
    place, _ = compared(view, view.extents(np.array([*shift, *np.zeros(11)])))
    assert place.quantity == "outline's place"
    assert place.chi_square > chi2.isf(1e-3, place.dof)


def test_another_object_has_another_shape(view: OutlineView) -> None:
    assert CAMERA is not None
    other = OutlineView(build("pitcher"), PLACE, CAMERA).extents(np.zeros(14))
    assert any(one.chi_square > chi2.isf(1e-3, one.dof) for one in compared(view, other))


def test_what_is_hidden_does_not_count(view: OutlineView) -> None:
    extents = view.extents(np.zeros(14)).copy()
    hidden = np.arange(DIRECTIONS) < 20
    extents[hidden] -= 50.0
    found = compared(view, extents, hidden)
    assert sum(one.chi_square for one in found) == pytest.approx(0.0, abs=1e-12)
    assert sum(one.dof for one in found) == DIRECTIONS - 20


def test_an_outline_that_is_hidden_all_around_is_refused(view: OutlineView) -> None:
    with pytest.raises(DataRefused, match="hidden"):
        outline_residuals(0, view, SeenOutline(np.zeros(DIRECTIONS), ~OPEN), USUAL, NOISE)


def test_an_object_behind_the_camera_is_refused() -> None:
    assert CAMERA is not None
    pose = CAMERA.base_from_camera.matrix
    behind = translation(pose[:3, 3] - 0.5 * pose[:3, 2])
    with pytest.raises(DataRefused, match="pose"):
        OutlineView(build("mug"), behind, CAMERA).extents(np.zeros(14))
