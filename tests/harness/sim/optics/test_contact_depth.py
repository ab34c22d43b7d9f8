"""Depth with a contact's own dimming taken out: on drawn presses with a known one, and on real balls."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from calibration.taxim.mark_free import Identity
from calibration.taxim.pictures import Pictures, read_pictures
from harness.basics.arrays import ByteArray, FloatArray, block_means
from harness.basics.errors import CalibrationRefused, DataRefused
from harness.sim.gel.gel import R15_SKIRT, deform
from harness.sim.optics.contact_depth import contact_colour, drift_of, read_depth
from harness.sim.optics.inverse import DRIFTING, STEADY, invert
from harness.sim.optics.optics import Optics
from harness.sim.optics.poisson import free_heights
from harness.sim.optics.shading import design, scaled_position
from harness.sim.optics.tactile_calibration import TactileCalibration, shipped_calibration
from tests.oracles.truemap import read_tmd
from tests.samples.ball_depth import WITHIN, fit_ball, taught, usable

PITCH = 0.1245e-3
LIGHT = np.array([-11.0, -13.0, -8.0])
"""Grey levels that a contact adds: about what real ones do."""

FOTS = Identity("GelSight", "FOTS", "MIT", "2026-01-01", 2e-3 / 19.58, 2.35e-3)
"""At half the pictures' resolution."""


@pytest.fixture(scope="module")
def bench() -> TactileCalibration:
    return shipped_calibration("gelsight_r15_bench")


@pytest.fixture(scope="module")
def dimmed(bench: TactileCalibration) -> TactileCalibration:
    """The bench's slopes exactly, and a contact that dims everywhere alike."""
    return _with_table(bench, LIGHT)


def _with_table(calibration: TactileCalibration, light: FloatArray) -> TactileCalibration:
    """A table drawn from the smooth model by its definition, with ``light`` added from 4 degrees on."""
    bins, rows, columns = calibration.bins, calibration.rows, calibration.columns
    step = 0.5 * np.pi / (bins - 1)
    steep, towards = np.meshgrid(
        (np.arange(bins) + 0.5) * step, -np.pi + (np.arange(bins) + 0.5) * 4.0 * step, indexing="ij"
    )
    sine = np.sin(steep).ravel()
    normal = -sine[:, None] * np.stack([np.cos(towards.ravel()), np.sin(towards.ravel())], axis=1)
    x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(0, columns - 1, 4), np.linspace(0, rows - 1, 4)))
    where = scaled_position(x, y, rows, columns)
    shades = np.stack(
        [design(normal, np.tile(place, (len(normal), 1))) @ calibration.smooth for place in where]
    )
    shades += light * (steep.ravel() > np.radians(4.0))[:, None]
    raw = np.stack([x * x, y * y, x * y, x, y, np.ones_like(x)], axis=1)
    table = np.einsum("tp,pnc->ntc", np.linalg.pinv(raw), shades).reshape(bins, bins, 6, 3)
    return replace(calibration, table=table.astype(np.float32))


def _ball(i: float, j: float, radius: float, depth: float = 1e-3) -> FloatArray:
    y, x = (np.mgrid[:120, :160] - np.array([i, j])[:, None, None]) * PITCH
    return np.asarray(np.maximum(0.0, depth - radius + np.sqrt(np.maximum(radius**2 - x * x - y * y, 0.0))))


def _drawn(calibration: TactileCalibration, press: FloatArray) -> tuple[ByteArray, FloatArray]:
    """A picture of a press that dims where the object touches, and the gel's surface."""
    gel = deform(press[None], R15_SKIRT)
    image = Optics(calibration, "smooth").render(gel).images.astype(np.float64)
    touched = press > R15_SKIRT.core * press.max()
    noise = np.random.default_rng(2).normal(0.0, 1.0, image.shape)
    return _byte(image + LIGHT * touched[None, ..., None] + noise), gel


def _byte(values: FloatArray) -> ByteArray:
    return np.clip(np.rint(values), 0.0, 255.0).astype(np.uint8)


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def test_a_table_parts_into_its_slopes_and_its_offset(
    bench: TactileCalibration, dimmed: TactileCalibration
) -> None:
    colour = contact_colour(dimmed)
    assert np.abs(colour.offset - LIGHT).max() < 0.05
    assert colour.misfit < 0.05
    normal = np.random.default_rng(0).uniform(-0.4, 0.4, (50, 2))
    where = np.random.default_rng(1).uniform(-1.0, 1.0, (50, 2))
    terms = design(normal, where)
    assert np.abs(terms @ colour.slopes - terms @ bench.smooth).max() < 0.1


@pytest.mark.parametrize(("i", "j", "radius"), [(60, 80, 6e-3), (45, 100, 4e-3)])
def test_what_a_contact_dims_is_not_taken_for_slope(
    dimmed: TactileCalibration, i: float, j: float, radius: float
) -> None:
    image, gel = _drawn(dimmed, _ball(i, j, radius))
    core = gel[0] > 0.5 * gel.max()
    twice, once = read_depth(image, dimmed).read.height[0], invert(image, dimmed).height[0]
    better, worse = (_rms((h - gel[0])[core] - (h - gel[0])[core].mean()) for h in (twice, once))
    assert better < 0.03e-3
    assert better < 0.7 * worse


def test_the_light_of_the_moment_is_found_beside_a_large_contact(dimmed: TactileCalibration) -> None:
    image, _ = _drawn(dimmed, _ball(60, 80, 12e-3))
    changed = np.array([7.0, -2.0, 12.0])
    assert np.abs(drift_of(_byte(image[0] + changed), dimmed.background) - changed).max() < 1.5
    steady = read_depth(image, dimmed, STEADY).read.height
    moved = read_depth(_byte(image + changed), dimmed, DRIFTING).read.height
    assert _rms(moved - steady) < 0.05e-3


def test_no_contact_is_nothing_at_all(dimmed: TactileCalibration) -> None:
    depth = read_depth(dimmed.background[None], dimmed)
    assert not depth.read.height.any()
    assert not depth.dimming.any()


def test_what_cannot_be_read_is_refused(dimmed: TactileCalibration) -> None:
    with pytest.raises(DataRefused, match="uint8"):
        read_depth(dimmed.background, dimmed)
    few = np.zeros_like(dimmed.support)
    few[10:12, :30] = True
    with pytest.raises(CalibrationRefused, match="60 bins"):
        contact_colour(replace(dimmed, support=few))


def _halved(pictures: Pictures) -> Pictures:
    """Every two by two pixels as their mean: a quarter of the work for the same contact."""
    small = [
        _byte(block_means(picture.astype(np.float64), 2))
        for picture in (pictures.background, *pictures.images)
    ]
    return replace(pictures, background=small[0], images=np.stack(small[1:]))


def test_real_balls_are_read_within_sixty_micrometres(shared_data: Path) -> None:
    """FOTS presses that the calibration never saw; of the sphere only centre and offset are fitted."""
    folder = shared_data / "tactile/fots_ball_presses"
    pack = usable(_halved(read_pictures(folder / "gelsight", folder / "gelsight_bg.png")), FOTS.ball)
    presses = np.arange(len(pack.images))
    made = taught(pack, None, presses[1::2], FOTS)
    held = pack.of(presses[::8])
    depth = read_depth(held.images, made.calibration, DRIFTING)
    fits = [
        fit_ball(height, centre + made.bias, WITHIN * made.contact, FOTS.pitch, FOTS.ball_radius)
        for height, centre in zip(depth.read.height, held.centres, strict=True)
    ]
    assert len(fits) == 6
    assert np.median([fit.rmse for fit in fits]) < 0.06e-3
    assert all(fit.rmse < 0.5 * fit.flat for fit in fits)


def test_gradients_of_a_measured_surface_give_it_back(shared_data: Path) -> None:
    measured = read_tmd(shared_data / "tactile/gelsight_groove/heightmap.tmd")
    surface = measured.heights / measured.pitch[0]
    down, right = np.gradient(surface)
    apart = free_heights(down, right) - (surface - surface.mean())
    assert np.abs(apart).max() < 0.02 * np.ptp(surface)
    assert _rms(apart) < 0.02 * surface.std()


def test_a_surface_cut_short_is_refused(tmp_path: Path) -> None:
    head = b"Binary TrueMap Data File v2.0\r\n\0made here\0"
    counts = np.array([3, 2], "<u4").tobytes() + np.array([0.3, 0.2, 0.0, 0.0], "<f4").tobytes()
    body = np.arange(6, dtype="<f4").tobytes()
    path = tmp_path / "small.tmd"
    path.write_bytes(head + counts + body)
    read = read_tmd(path)
    assert np.allclose(read.heights, np.arange(6).reshape(2, 3) * 1e-3)
    assert np.allclose(read.pitch, 0.1e-3)
    path.write_bytes(head + counts + body[:-2])
    with pytest.raises(DataRefused, match="2 x 3"):
        read_tmd(path)
    path.write_bytes(b"something else")
    with pytest.raises(DataRefused, match="TrueMap"):
        read_tmd(path)
