"""Light adds; pictures on disk are encoded; and neither changes what the other says."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.basics.errors import OutOfDomain
from harness.picture.linear_image import LinearImage, binned
from harness.picture.srgb import LINEAR_OF_BYTE, bytes_from_linear, linear_from_srgb, srgb_from_linear


@given(st.floats(-4.0, 4.0))
def test_encoding_and_decoding_are_inverse(light: float) -> None:
    back = linear_from_srgb(srgb_from_linear(np.array([light])))[0]
    # The standard's two pieces meet to five digits only: within them a value may come back from the other.
    assert back == pytest.approx(light, rel=1e-6, abs=1e-9)


def test_encoding_is_the_standards() -> None:
    # Middle grey: 0.5 encoded is 0.21404 of white (IEC 61966-2-1); the pieces meet at 0.04045.
    assert linear_from_srgb(np.array([0.5]))[0] == pytest.approx(0.21404114, rel=1e-7)
    below, above = linear_from_srgb(np.array([0.04045, np.nextafter(0.04045, 1.0)]))
    assert above == pytest.approx(below, rel=2e-5)


def test_every_grey_level_survives() -> None:
    levels = np.arange(256, dtype=np.uint8)
    np.testing.assert_array_equal(bytes_from_linear(LINEAR_OF_BYTE), levels)


def picture(alpha: float, light: float = 0.5) -> LinearImage:
    shape = (3, 5)
    return LinearImage(np.full((*shape, 3), alpha * light), np.full(shape, alpha), np.full(shape, 1.0))


def test_half_covered_is_half_of_both_in_light_not_in_grey_levels() -> None:
    np.testing.assert_allclose(picture(0.5, light=0.0).over(1.0), 0.5)
    assert picture(0.5, light=0.0).display(1.0)[0, 0, 0] == 188


def test_before_its_own_colour_coverage_is_not_seen() -> None:
    for alpha in (0.0, 0.3, 1.0):
        np.testing.assert_allclose(picture(alpha).over(0.5), 0.5)


def test_what_is_covered_wholly_hides_what_is_behind() -> None:
    np.testing.assert_array_equal(picture(1.0).over(0.0), picture(1.0).over(1.0))


def test_exposure_leaves_what_is_behind() -> None:
    assert picture(0.0).display(1.0, exposure=0.1)[0, 0, 0] == 255
    assert picture(1.0).display(1.0, exposure=0.0)[0, 0, 0] == 0


@pytest.mark.parametrize("exposure", [-1.0, np.nan, np.inf])
def test_an_exposure_that_is_none_is_refused(exposure: float) -> None:
    with pytest.raises(OutOfDomain, match="exposure"):
        picture(1.0).display(exposure=exposure)


def test_pictures_of_other_shapes_are_refused() -> None:
    with pytest.raises(OutOfDomain, match="rows, columns"):
        LinearImage(np.zeros((3, 4, 3)), np.zeros((3, 5)), np.zeros((3, 5)))


def test_larger_pixels_hold_the_same_light_and_the_depth_of_what_they_show() -> None:
    random = np.random.default_rng(4)
    alpha = random.random((6, 8)) * (random.random((6, 8)) < 0.5)
    alpha[:2, :2] = 0.0
    depth = np.where(alpha > 0.0, random.uniform(1.0, 2.0, (6, 8)), np.inf)
    fine = LinearImage(random.random((6, 8, 3)) * alpha[..., None], alpha, depth)
    found = binned(fine, 2)
    assert found.alpha.shape == (3, 4)
    np.testing.assert_allclose(found.colour.sum(axis=(0, 1)), fine.colour.sum(axis=(0, 1)) / 4.0)
    np.testing.assert_allclose(found.alpha.sum(), alpha.sum() / 4.0)
    assert np.isinf(found.depth[0, 0])
    corner = (slice(2, 4), slice(4, 6))
    assert found.depth[1, 2] == pytest.approx(
        np.average(depth[corner][alpha[corner] > 0.0], weights=alpha[corner][alpha[corner] > 0.0])
    )
    np.testing.assert_array_equal(binned(fine, 1).colour, fine.colour)


@pytest.mark.parametrize("by", [0, 4, 5])
def test_pixels_that_do_not_fit_into_larger_ones_are_refused(by: int) -> None:
    with pytest.raises(OutOfDomain, match=f"{by} x {by}"):
        binned(picture(1.0), by)
