"""Pixels made square: discs become round, places go with them, and what was square stays to the bit."""

import numpy as np
import pytest

from harness.basics.arrays import ByteArray, FloatArray
from harness.basics.errors import OutOfDomain
from harness.picture.square_pixels import MADE_SQUARE, aspect_stated, made_square, square_places

ROWS, COLUMNS = 100, 130


def blob(middle: FloatArray, wide: float, high: float) -> ByteArray:
    """A smooth bright spot whose widths are ``wide`` and ``high`` pixels."""
    y, x = np.mgrid[:ROWS, :COLUMNS].astype(float)
    bright = np.exp(-0.5 * (((x - middle[0]) / wide) ** 2 + ((y - middle[1]) / high) ** 2))
    drawn: FloatArray = 30.0 + 200.0 * bright[..., None] * np.array([1.0, 0.8, 0.6])
    return np.round(drawn).astype(np.uint8)


def moments(picture: ByteArray) -> tuple[FloatArray, FloatArray]:
    """Middle and variances (column, row) of what is brighter than the ground."""
    weight = np.maximum(picture[..., 0].astype(float) - 32.0, 0.0)
    y, x = np.mgrid[:ROWS, :COLUMNS].astype(float)
    total = weight.sum()
    middle = np.array([(weight * x).sum(), (weight * y).sum()]) / total
    spread = np.array([(weight * (x - middle[0]) ** 2).sum(), (weight * (y - middle[1]) ** 2).sum()]) / total
    return middle, spread


@pytest.mark.parametrize("aspect", [0.97, 1.03, 1.3])
def test_what_is_round_on_the_gel_is_round_in_the_picture(aspect: float) -> None:
    middle = np.array([70.0, 40.0])
    # Of pixels too high a round thing covers fewer rows.
    seen = blob(middle, 9.0 * aspect**0.5, 9.0 * aspect**-0.5)
    found, spread = moments(made_square(seen, aspect))
    assert spread[1] / spread[0] == pytest.approx(1.0, abs=2e-3)
    assert np.prod(spread) == pytest.approx(np.prod(moments(seen)[1]), rel=5e-3)
    assert found == pytest.approx(square_places(middle, ROWS, COLUMNS, aspect), abs=0.02)


@pytest.mark.parametrize("aspect", [0.97, 1.03])
def test_the_inverse_undoes_it(aspect: float) -> None:
    seen = blob(np.array([60.0, 55.0]), 7.0, 7.0)
    back = made_square(made_square(seen, aspect), 1.0 / aspect)
    # Rounded to whole grey levels twice.
    assert np.abs(back.astype(int) - seen)[5:-5, 5:-5].max() <= 1
    places = np.random.default_rng(0).uniform(0.0, 90.0, (20, 2))
    there = square_places(places, ROWS, COLUMNS, aspect)
    assert square_places(there, ROWS, COLUMNS, 1.0 / aspect) == pytest.approx(places)


def test_square_pixels_are_handed_back_to_the_bit() -> None:
    seen = np.random.default_rng(1).integers(0, 256, (3, 20, 30, 3), dtype=np.uint8)
    assert np.array_equal(made_square(seen, 1.0), seen)


def test_many_pictures_are_each_made_square() -> None:
    pictures = np.stack([blob(np.array([x, 50.0]), 8.0, 6.0) for x in (40.0, 60.0, 90.0)])
    together = made_square(pictures, 1.05)
    assert np.array_equal(together, np.stack([made_square(one, 1.05) for one in pictures]))


def test_one_colour_stays_that_colour_out_to_the_border() -> None:
    plain = np.full((30, 40, 3), (12, 200, 255), dtype=np.uint8)
    for aspect in (0.8, 1.25):
        assert np.array_equal(made_square(plain, aspect), plain)


@pytest.mark.parametrize("aspect", [0.0, -1.0, 0.4, 2.5, np.nan, np.inf])
def test_what_is_no_aspect_is_refused(aspect: float) -> None:
    with pytest.raises(OutOfDomain, match=r"0\.5 to 2 "):
        made_square(np.zeros((4, 4, 3), np.uint8), aspect)


@pytest.mark.parametrize("aspect", [1.0, 0.9637, 1.03])
def test_what_a_calibration_states_of_its_aspect_is_read_back(aspect: float) -> None:
    squared = "" if aspect == 1.0 else f", {MADE_SQUARE} {aspect:.6f}"
    assert aspect_stated(f"sha256 ab, 49 presses without marks{squared}") == pytest.approx(aspect)


def test_an_aspect_of_no_camera_is_refused() -> None:
    with pytest.raises(OutOfDomain, match=r"\b30 .*0\.5 to 2 "):
        aspect_stated("presses, made square by 30.0")
