"""Damaged presses and damaged sets, each refused with its own reason; and real presses, which are not."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from calibration.taxim.gates import check_set, refusals, sightings
from calibration.taxim.pictures import Pictures, Refused, read_pictures
from harness.basics.errors import CalibrationRefused
from tests.samples.drawn_presses import BALL, DrawnGel, drawn_set, press_set, rounded

GEL = DrawnGel()
REST = rounded(GEL.rest())
Image = NDArray[np.uint8]


def _kinds(pictures: Pictures) -> dict[str, str]:
    verdicts = refusals(pictures, sightings(pictures, BALL), BALL)
    return {one.name: one.kind for one in verdicts if one is not None}


def _exchanged(image: Image) -> Image:
    return image[..., ::-1]


def _drifted(image: Image) -> Image:
    return rounded(image + np.array([55.0, 50.0, 45.0]))


def _overexposed(image: Image) -> Image:
    near = np.abs(image.astype(np.float64) - REST).sum(axis=2) > 12.0
    return np.where(near[..., None], 255, image).astype(np.uint8)


def _cut_short(image: Image) -> Image:
    cut = image.copy()
    cut[-32:] = 128
    return cut


def _empty(_: Image) -> Image:
    return rounded(GEL.rest() + np.random.default_rng(5).normal(0.0, 1.0, REST.shape))


def _off_the_image(_: Image) -> Image:
    return rounded(GEL.press((-3.0, 40.0), 5))


def _a_cloth(_: Image) -> Image:
    y, x = np.mgrid[: REST.shape[0], : REST.shape[1]]
    weave = np.sin(2.0 * np.pi * x / 6.0) * np.sin(2.0 * np.pi * y / 7.0) * (np.hypot(x - 64, y - 48) < 30)
    return rounded(GEL.rest() + weave[..., None] * np.array([60.0, -50.0, 40.0]))


@pytest.mark.parametrize(
    ("damage", "kind"),
    [
        (_exchanged, "channels"),
        (_drifted, "drift"),
        (_overexposed, "saturated"),
        (_cut_short, "lost"),
        (_empty, "no press"),
        (_off_the_image, "off the image"),
        (_a_cloth, "no ball"),
    ],
)
def test_one_damaged_press_is_refused_with_its_reason(damage: object, kind: str) -> None:
    pictures, _ = drawn_set(20)
    images = list(pictures.images)
    assert callable(damage)
    images[4] = damage(images[4])
    assert _kinds(press_set(images, REST)) == {"0004.png": kind}


@pytest.mark.parametrize(("clipped", "refused"), [(0.3, False), (0.49, False), (0.51, True), (0.7, True)])
def test_a_press_of_which_more_than_half_is_clipped_is_refused(clipped: float, refused: bool) -> None:
    """Published sets have up to 0.3 of the changed pixels clipped and stay usable."""
    pictures, _ = drawn_set(16)
    seen = sightings(pictures, BALL)
    seen[4] = replace(seen[4], clipped=clipped)
    verdict = refusals(pictures, seen, BALL)[4]
    assert (verdict is not None) == refused
    if verdict is not None:
        assert verdict.kind == "saturated"
        assert f"{clipped:.0%} of what changed" in verdict.reason


def test_the_same_press_twice_is_kept_once() -> None:
    """The very file, and another frame of the same press with noise of its own."""
    pictures, centres = drawn_set(16)
    frame = rounded(GEL.press((centres[2][0], centres[2][1]), 99))
    found = refusals(
        given := press_set([*pictures.images, pictures.images[5], frame], REST), sightings(given, BALL), BALL
    )
    refused = [one for one in found if one is not None]
    assert [(one.name, one.kind) for one in refused] == [("0016.png", "twice"), ("0017.png", "twice")]
    assert "0005.png" in refused[0].reason
    assert "0002.png" in refused[1].reason


def test_neighbouring_presses_are_not_the_same_press() -> None:
    pictures, centres = drawn_set(16)
    near = rounded(GEL.press((centres[2][0] + 0.08 * BALL, centres[2][1]), 99))
    assert _kinds(press_set([*pictures.images, near], REST)) == {}


def test_light_that_drifts_alike_over_the_picture_is_taken_out() -> None:
    pictures, _ = drawn_set(16)
    images = [rounded(image + 1.5 * k) for k, image in enumerate(pictures.images)]
    assert _kinds(press_set(images, REST)) == {}


def _checked(pictures: Pictures) -> None:
    seen = sightings(pictures, BALL)
    check_set(pictures, refusals(pictures, seen, BALL), seen, BALL)


@pytest.mark.parametrize(
    ("damage", "says"),
    [
        (_exchanged, r"20 of 20 .*0000\.png.*--channels"),
        (_drifted, r"20 of 20 .*0000\.png.* 55 .* 40"),
        (_overexposed, r"20 of 20 .*0000\.png.* 0 or 255 .*50%"),
        (_empty, r"20 of 20 .*0000\.png.* 0\.5 .* 8 "),
        (_a_cloth, r"20 of 20 .*0000\.png.*ball"),
    ],
)
def test_a_set_damaged_throughout_is_refused_as_a_whole(damage: object, says: str) -> None:
    pictures, _ = drawn_set(20)
    assert callable(damage)
    with pytest.raises(CalibrationRefused, match=says):
        _checked(press_set([damage(image) for image in pictures.images], REST))


def test_too_few_presses_are_refused() -> None:
    pictures, _ = drawn_set(14)
    with pytest.raises(CalibrationRefused, match=r"14 presses.*15"):
        _checked(pictures)


def test_presses_all_at_one_place_are_refused() -> None:
    rng = np.random.default_rng(3)
    places = np.array([60.0, 45.0]) + rng.uniform(-6.0, 6.0, (20, 2))
    images = [rounded(GEL.press((x, y), k)) for k, (x, y) in enumerate(places)]
    with pytest.raises(CalibrationRefused, match=r"6%.*12%.*2\.5%.*5%"):
        _checked(press_set(images, REST))


def test_presses_in_a_row_are_refused() -> None:
    images = [rounded(GEL.press((x, 48.0), k)) for k, x in enumerate(np.linspace(14, 113, 20))]
    with pytest.raises(CalibrationRefused, match=r"18%.*12%.*0\.0%.*5%"):
        _checked(press_set(images, REST))


def test_files_of_another_size_count_among_the_refused() -> None:
    pictures, _ = drawn_set(15)
    others = tuple(Refused(f"x{k}.png", "size", "of another camera") for k in range(16))
    with pytest.raises(CalibrationRefused, match=r"16 of 31 .*x0\.png: of another camera"):
        _checked(replace(pictures, refused=others))


def test_real_presses_are_all_kept_and_found_near_their_marks(shared_data: Path) -> None:
    """Hand marks lie 1.1 px from the fitted centres in the median; the detector sees each picture alone."""
    pictures = read_pictures(shared_data / "tactile/objectfolder_calibs")
    ball = 2.0 / 0.1245
    seen = sightings(pictures, ball)
    assert [one for one in refusals(pictures, seen, ball) if one is not None] == []
    assert pictures.marks is not None
    apart = np.array([one.found.centre for one in seen]) - pictures.marks[:, :2]
    apart -= np.median(apart, axis=0)
    assert np.median(np.hypot(*apart.T)) < 1.6
    assert np.hypot(*apart.T).max() < 6.0
