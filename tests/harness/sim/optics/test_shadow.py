"""Shadows: Taxim's published pictures, and what must hold of any table."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy import ndimage

from harness.basics.arrays import BoolArray, FloatArray
from harness.basics.errors import CalibrationRefused, OutOfDomain
from harness.bench.sensor import GELSIGHT_R15
from harness.sim.optics.kernels import change_exactly
from harness.sim.optics.shadow import SOFTNESS, Beyond, ShadowTable, cast_shadows, darkened, darkening, rim
from harness.sim.optics.shadow_file import read_shadow_table
from harness.sim.optics.tactile_calibration import shipped_calibration

PITCH = 0.0295e-3


def _made_up(level: float = -30.0, samples: int = 12) -> ShadowTable:
    directions = np.linspace(0.0, 6.2, 63)
    lengths = np.full((3, 63, 9), samples)
    return ShadowTable(directions, lengths, np.full(int(lengths.sum()), level), shallowest=-0.2e-3)


def _post(height: float) -> FloatArray:
    post = np.zeros((1, 60, 70))
    post[0, 25:35, 30:40] = height
    return post


def _soft(change: FloatArray, background: FloatArray) -> FloatArray:
    blurred = np.stack([ndimage.gaussian_filter(change[..., c], 2.0) for c in range(3)], axis=-1)
    drawn = cv2.GaussianBlur((blurred + background).astype(np.float32), (5, 5), 0)
    return np.clip(np.rint(np.asarray(drawn, dtype=np.float64)), 0, 255)


def _decibels(a: FloatArray, b: FloatArray) -> float:
    return float(10 * np.log10(255.0**2 / np.mean((a - b) ** 2)))


@pytest.mark.parametrize("name", ["cylinder6", "square"])
def test_the_published_shadows_are_drawn(shared_data: Path, name: str) -> None:
    """The background comes from the picture without shadows; JPEG then allows about 49 dB.

    The contact mask was not published: it is taken as what lies within 0.12 mm of the full press of
    1 mm, where the last blur leaves the edge of these flat-topped objects.
    """
    taxim = shared_data / "tactile/taxim"
    with np.load(taxim / "gelsight_lab/polycalib.npz", allow_pickle=False) as published:
        colours = np.stack([published[f"grad_{c}"] for c in "bgr"], axis=-1)
    # The program that made the pictures adds six rows to a depth counted from 0.4 mm.
    table = read_shadow_table(taxim / "gelsight_lab/shadowTable.npz", shallowest=-0.2e-3)
    gel = cv2.GaussianBlur(np.load(taxim / "gelsight_lab/gelmap5.npy").astype(np.float64), (5, 5), 0)
    surface = np.load(taxim / f"published_results/{name}_height.npy").astype(np.float64)
    plain, wanted = (
        np.asarray(cv2.imread(str(taxim / f"published_results/{name}_{kind}.jpg")), np.float64)[..., ::-1]
        for kind in ("sim", "shadow")
    )
    change = np.empty((480, 640, 3))
    change_exactly(surface, colours, change)
    background = np.rint(plain - change)
    above = surface + np.asarray(gel)
    pressed = (above - above.max()) * PITCH + 1e-3
    shaded, outside = cast_shadows(
        change[None], pressed[None], surface[None], pressed[None] > 0.88e-3, table, beyond="skip"
    )
    assert _decibels(_soft(shaded[0], background), wanted) > 48.5
    assert _decibels(_soft(change, background), wanted) < 44.5
    assert outside[0] > 0.3  # as the published program drops them, without a word


def test_no_contact_throws_no_shadow_to_the_bit() -> None:
    change = np.random.default_rng(0).normal(0, 5, (2, 60, 70, 3))
    nothing = np.zeros((2, 60, 70))
    shaded, outside = cast_shadows(change, nothing, nothing, nothing > 0, _made_up())
    assert np.array_equal(shaded, change)
    assert not outside.any()


def test_a_contact_over_the_whole_sensor_has_no_rim() -> None:
    full = np.ones((1, 60, 70))
    shaded, _ = cast_shadows(np.zeros((1, 60, 70, 3)), full, full, full > 0, _made_up())
    assert not shaded.any()


def test_shadows_fall_outside_the_contact_and_only_darken() -> None:
    post = ndimage.gaussian_filter(_post(1e-3), (0, 1.5, 1.5))
    core = _post(1e-3) > 0
    before = np.random.default_rng(1).normal(0, 10, (1, 60, 70, 3))
    shaded, _ = cast_shadows(before, post, post / PITCH, core, _made_up())
    assert (shaded <= before).all()
    assert (shaded < before).sum() > 300
    assert np.array_equal(shaded[core], before[core])


@pytest.mark.parametrize(("beyond", "thrown"), [("hold", True), ("skip", False)])
def test_depths_outside_the_table_are_counted_and_held_or_skipped(beyond: Beyond, thrown: bool) -> None:
    post = ndimage.gaussian_filter(_post(8e-3), (0, 1.5, 1.5)) + 1e-3
    core = _post(1.0) > 0
    shaded, outside = cast_shadows(
        np.zeros((1, 60, 70, 3)), post, post / PITCH, core, _made_up(), beyond=beyond
    )
    assert outside[0] == 1.0
    assert shaded.any() == thrown


def _drawn_at_random(seed: int) -> ShadowTable:
    """Lists of every length, none among them, by channel, direction and depth."""
    rng = np.random.default_rng(seed)
    lengths = rng.integers(0, 14, (3, 63, 9))
    return ShadowTable(
        np.linspace(0.0, 6.2, 63), lengths, rng.normal(-20.0, 10.0, int(lengths.sum())), shallowest=0.2e-3
    )


def _thrown(
    surface: FloatArray, deep: FloatArray, core: BoolArray, table: ShadowTable, beyond: Beyond
) -> FloatArray:
    """What shadows leave of nothing, sample by sample as the method says it (Si and Yuan, 2022)."""
    left = np.zeros((*surface.shape, 3))
    lists = np.split(table.values, np.cumsum(table.lengths.ravel())[:-1])
    down, along = (np.pad((surface[2:, 1:-1] - surface[:-2, 1:-1]) / 2, 1), np.zeros_like(surface))
    along[1:-1, 1:-1] = (surface[1:-1, 2:] - surface[1:-1, :-2]) / 2
    for i, j in np.argwhere(rim(core)):
        row = int(np.floor((deep[i, j] - table.shallowest) / table.depth_step))
        if beyond == "skip" and not 0 <= row < 9:
            continue
        row = min(max(row, 0), 8)
        d = int((np.arctan2(down[i, j], along[i, j]) + np.pi) // 0.1)
        for turn in np.arange(table.directions[d] - 0.1, table.directions[d] + 0.1, 0.05):
            for c in range(3):
                levels = lists[(c * 63 + d) * 9 + row]
                for s in range(1, len(levels)):
                    y, x = int(i + 1.25 * s * np.sin(turn)), int(j + 1.25 * s * np.cos(turn))
                    within = 0 <= y < surface.shape[0] and 0 <= x < surface.shape[1]
                    if within and surface[i, j] > surface[y, x]:
                        left[y, x, c] = min(left[y, x, c], levels[s])
    return left


@pytest.mark.parametrize("beyond", ["hold", "skip"])
@pytest.mark.parametrize("seed", range(4))
def test_every_sample_of_every_ray_falls_where_the_method_says(seed: int, beyond: Beyond) -> None:
    rng = np.random.default_rng(seed)
    deep = 1.4e-3 * ndimage.gaussian_filter(_post(1.0)[0] + rng.normal(0, 0.3, (60, 70)), 1.5)
    # At the border too, where rays leave the picture.
    core = (_post(1.0)[0] > 0) | (rng.random((60, 70)) < 0.002)
    table = _drawn_at_random(seed)
    shaded, _ = cast_shadows(
        np.zeros((1, 60, 70, 3)), deep[None], deep[None] / PITCH, core[None], table, beyond=beyond
    )
    wanted = _thrown(deep / PITCH, deep, core, table, beyond)
    assert (wanted < 0.0).sum() > 500
    assert np.array_equal(shaded[0], wanted)


def test_the_rim_is_four_pixels_wide() -> None:
    ring = rim(_post(1.0)[0] > 0)
    assert ring.sum() == 18 * 18 - 10 * 10
    assert ring[21, 26]
    assert not ring[20, 26]


def test_tables_that_do_not_hold_together_are_refused() -> None:
    good = _made_up()
    with pytest.raises(CalibrationRefused, match="samples"):
        ShadowTable(good.directions, good.lengths, good.values[:-1], -0.2e-3)
    with pytest.raises(CalibrationRefused, match="directions"):
        ShadowTable(good.directions[:-1], good.lengths, good.values, -0.2e-3)
    nothing = np.zeros((1, 6, 7))
    with pytest.raises(OutOfDomain, match="core"):
        cast_shadows(np.zeros((1, 6, 8, 3)), nothing, nothing, nothing > 0, good)


@pytest.mark.parametrize("place", [(60, 80), (4, 6), (110, 150)])
def test_a_shadow_is_the_same_whether_a_part_or_all_of_the_picture_is_looked_at(
    place: tuple[int, int],
) -> None:
    calibration = shipped_calibration("gelsight_r15_bench")
    y, x = np.mgrid[:120, :160]
    deep = np.maximum(0.0, 1e-3 - 4e-6 * ((y - place[0]) ** 2 + (x - place[1]) ** 2))[None]
    gel = ndimage.gaussian_filter(deep, (0, 2.0, 2.0))
    plain = calibration.background[None]
    taken, outside = darkening(plain, deep, gel, GELSIGHT_R15, calibration, _made_up())
    core = (deep > calibration.header.skirt.core * deep.max()) & (deep > 0.0)
    change = np.zeros((*deep.shape, 3))
    whole, share = cast_shadows(change, gel, gel / calibration.header.pitch, core, _made_up())
    sigma = SOFTNESS / calibration.header.pitch
    soft = ndimage.gaussian_filter(-whole, (0.0, sigma, sigma, 0.0))
    assert soft.max() > 10.0
    assert np.abs(taken - soft).max() < 1e-4
    assert outside[0] == share[0]
    drawn = darkened(plain, taken)
    assert np.array_equal(drawn[0][taken[0] == 0.0], plain[0][taken[0] == 0.0])
    assert np.array_equal(
        drawn, np.clip(np.rint(plain - taken.astype(np.float64)), 0.0, 255.0).astype(np.uint8)
    )
