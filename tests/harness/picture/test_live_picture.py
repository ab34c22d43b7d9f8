"""A camera's picture beside the simulated one: masks that meet, differences that grow with what is wrong."""

from dataclasses import replace

import numpy as np
import pytest

from harness.basics.arrays import ByteArray
from harness.basics.errors import DataRefused
from harness.picture.linear_image import LinearImage
from harness.picture.live_picture import compare_live
from harness.picture.object_mask import mask_by_background, mask_by_colours, overlap
from tests.samples.exposed_pictures import GAIN, bench_alone, pictured, taken

IMAGE = pictured()
LIVE, BENCH = taken(IMAGE), bench_alone(IMAGE)


@pytest.mark.parametrize(("background", "by"), [(BENCH, "background"), (None, "colours")])
def test_the_same_object_is_found_where_it_is(background: ByteArray | None, by: str) -> None:
    found = compare_live(LIVE, IMAGE, background)
    assert found.masked_by == by
    assert found.overlap > 0.97
    assert (np.abs(found.exposure.gain - GAIN) < 4.0 * found.exposure.gain_error + 1.0 / 255.0).all()
    assert found.fitted.psnr_db > 38.0
    assert found.fitted.psnr_db > found.unfitted.psnr_db + 10.0
    assert found.fitted.ssim > found.unfitted.ssim
    # What is left is the camera's noise, in grey levels of the middle of the scale.
    assert found.fitted.rms_grey < 3.0
    assert set(found.seconds) == {"fit", "mask", "difference"}


def test_a_camera_that_adds_nothing_leaves_its_rounding() -> None:
    """Gain one, offset zero, no noise: the fit changes it by less than a grey level's rounding."""
    found = compare_live(taken(IMAGE, 0.0, 1, np.ones(3), np.zeros(3)), IMAGE, bench_alone(IMAGE, 0.0))
    assert max(found.unfitted.rms_grey, found.fitted.rms_grey) < 1.0 / np.sqrt(12.0)
    np.testing.assert_allclose(found.exposure.gain, 1.0, atol=0.003)


def test_an_object_that_moved_meets_less_and_less() -> None:
    """A disc of radius r moved by d: the overlap of two discs is known."""
    found = []
    for moved in (0.0, 6.0, 15.0):
        there = compare_live(taken(pictured(off=(0.0, moved))), IMAGE, BENCH)
        half = moved / 2.0 / 36.0
        common = 2.0 / np.pi * (np.arccos(half) - half * np.sqrt(1.0 - half**2))
        # An outline is known to half a pixel, which is 1 / r of a disc's area.
        assert there.overlap == pytest.approx(common / (2.0 - common), abs=1.0 / 36.0)
        found.append(there)
    assert found[0].fitted.psnr_db > found[1].fitted.psnr_db > found[2].fitted.psnr_db
    assert found[0].fitted.ssim > found[1].fitted.ssim > found[2].fitted.ssim


def test_what_moved_elsewhere_on_the_bench_is_not_the_object() -> None:
    live = LIVE.copy()
    live[2:8, 2:12] = 250
    silhouette = IMAGE.alpha >= 0.5
    for mask in (mask_by_background(live, BENCH, silhouette), mask_by_colours(live, silhouette)):
        assert not mask[:9, :13].any()
        assert overlap(mask, silhouette) > 0.97


def test_a_bench_that_was_not_pictured_counts_for_nothing() -> None:
    """Beside the object the simulated picture is then the live one itself."""
    found = compare_live(LIVE, IMAGE)
    outside = IMAGE.alpha == 0.0
    np.testing.assert_array_equal(found.simulated[outside], LIVE[outside])


def test_masks_without_a_pixel_are_the_same() -> None:
    none = np.zeros((4, 5), bool)
    assert overlap(none, none) == 1.0
    assert overlap(none, ~none) == 0.0


@pytest.mark.parametrize("background", [BENCH, None])
def test_a_picture_of_another_size_is_refused(background: ByteArray | None) -> None:
    with pytest.raises(DataRefused, match=r"95 x 96 pixels.*96 x 96"):
        compare_live(LIVE[:, 1:], IMAGE, background)
    with pytest.raises(DataRefused, match="96 x 90"):
        compare_live(LIVE, IMAGE, BENCH[6:])


@pytest.mark.parametrize("radius", [0.0, 8.0])
def test_an_object_too_small_is_refused(radius: float) -> None:
    small = pictured(radius=radius)
    with pytest.raises(DataRefused, match=r"pixels in \d+ blocks"):
        compare_live(taken(small), small)


def test_an_object_that_fills_the_picture_needs_a_picture_of_the_bench() -> None:
    full = pictured(radius=200.0)
    with pytest.raises(DataRefused, match=r"\ball\b.*picture"):
        compare_live(taken(full), full)
    assert compare_live(taken(full), full, BENCH).overlap > 0.9


def test_light_that_is_not_finite_is_refused() -> None:
    colour, alpha = IMAGE.colour.copy(), IMAGE.alpha.copy()
    colour[50, 50] = np.nan
    alpha[40, 40] = np.nan
    for wrong in (replace(IMAGE, colour=colour), LinearImage(IMAGE.colour, alpha, IMAGE.depth)):
        with pytest.raises(DataRefused, match="3 of 27648"):
            compare_live(LIVE, wrong)


def test_a_saturated_picture_is_refused() -> None:
    with pytest.raises(DataRefused, match="saturated"):
        compare_live(np.full_like(LIVE, 255), IMAGE)
