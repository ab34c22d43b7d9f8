"""The mask of an object in a picture keeps its thin parts and tips and drops noise."""

import numpy as np
import pytest

from harness.basics.arrays import BoolArray
from harness.picture.object_mask import mask_by_background
from harness.picture.outline import read_outline

ROWS, COLUMNS = 120, 160


def blade(slope: float, waist: int) -> BoolArray:
    """A disc with a tapered blade that ends in a tip about one pixel thick."""
    rows, columns = np.mgrid[:ROWS, :COLUMNS]
    disc = np.hypot(rows - 60.0, columns - 40.0) < 20.0
    along = columns - 40
    half = np.maximum(waist * (1.0 - along / 100.0), 0.6)
    return np.asarray(disc | ((along > 0) & (along < 100) & (np.abs(rows - 60.0 - slope * along) < half)))


def seen(mask: BoolArray, noise: float) -> BoolArray:
    """Read the mask back from a picture of the object and one of the bench, both noisy."""
    random, bare = np.random.default_rng(0), np.full((ROWS, COLUMNS, 3), 90.0)
    live = np.where(mask[..., None], 160.0, bare)
    picture, background = (
        np.clip(one + noise * random.standard_normal(one.shape), 0, 255).astype(np.uint8)
        for one in (live, bare)
    )
    return mask_by_background(picture, background)


@pytest.mark.parametrize("slope", [0.0, 0.15, -0.3])
@pytest.mark.parametrize("noise", [0.0, 2.0])
def test_a_thin_blade_is_seen_to_its_tip(slope: float, noise: float) -> None:
    mask = blade(slope, 2)
    found, true = read_outline(seen(mask, noise)), read_outline(mask)
    assert found.extents == pytest.approx(true.extents, abs=0.1)


def test_small_spots_elsewhere_are_noise_and_a_large_one_is_not() -> None:
    mask = blade(0.0, 2)
    spots = mask.copy()
    spots[5:7, 5:15] = True  # two pixels thin, away from the object
    assert (seen(spots, 2.0) == mask).all()
    spots[5:8, 5:15] = True
    assert (seen(spots, 2.0) == spots).all()
