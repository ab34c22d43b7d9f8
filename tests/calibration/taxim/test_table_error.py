"""What a table says it is off by, against how far tables of other presses are off."""

from pathlib import Path

import numpy as np
import pytest

from calibration.taxim.mark_free import Identity
from calibration.taxim.pictures import PressPack
from harness.basics.arrays import BoolArray, FloatArray
from tests.samples.drawn_presses import BALL, DrawnGel, drawn_set
from tests.samples.real_press import R15, set_of
from tests.samples.table_halves import Taught, apart, halves, packed, reached, taught

WHO = Identity("drawn", "0", "none", "2026-01-01", pitch=1e-4, ball_radius=BALL * 1e-4)


def presses(count: int, noise: float = 1.0) -> PressPack:
    pictures, centres = drawn_set(count, DrawnGel(dimming=6.0, noise=noise))
    return packed(pictures, centres, WHO)


@pytest.fixture(scope="module")
def forty() -> PressPack:
    return presses(40)


@pytest.fixture(scope="module")
def pair(forty: PressPack) -> tuple[Taught, Taught]:
    return halves(forty, BALL)


def off_by(pair: tuple[Taught, Taught], bins: BoolArray) -> FloatArray:
    """``(3,)`` how many times as far apart tables are as both say, over bins."""
    found, said = apart(pair)
    return np.asarray(np.sqrt((found[bins] ** 2).mean(axis=0) / (said[bins] ** 2).mean(axis=0)))


def assert_as_far_off_as_both_say(pair: tuple[Taught, Taught]) -> None:
    """Errors of neighbouring bins go together, so that thousands of bins say it to a factor, here of 1.5.

    Where neither has presses both have the smooth model's misfit in common, of which their difference says
    nothing: there they may be nearer, not farther.
    """
    kinds = reached(pair)
    assert min(bins.sum() for bins in kinds.values()) > 500
    for kind in ("both", "one"):
        ratio = off_by(pair, kinds[kind])
        assert ((ratio > 1.0 / 1.5) & (ratio < 1.5)).all(), (kind, ratio)
    assert (off_by(pair, kinds["neither"]) < 1.5).all()


@pytest.mark.slow  # measured data that do not change
def test_tables_of_other_presses_are_as_far_off_as_both_say(pair: tuple[Taught, Taught]) -> None:
    assert_as_far_off_as_both_say(pair)


@pytest.mark.slow  # measured data that do not change
def test_presses_of_the_papers_sensor_say_how_far_they_are_off(shared_data: Path) -> None:
    pictures = set_of(shared_data, "r15")
    assert pictures.marks is not None
    pair = halves(packed(pictures, pictures.marks[:, :2], R15), R15.ball)
    assert_as_far_off_as_both_say(pair)


def test_the_true_colours_are_as_far_off_as_is_said(forty: PressPack) -> None:
    """Of bins that no press reached too; truth is the formula that the presses were drawn by.

    All presses are held against one picture of the untouched gel, whose rounding no press can show.
    """
    whole = taught(forty, np.arange(40), BALL)
    x, y = whole.model.fit.centres.T
    terms = np.stack([x * x, y * y, x * y, x, y, np.ones_like(x)], axis=1)
    shown = np.einsum("pt,ijtc->pijc", terms, whole.model.table.astype(np.float64))
    found = np.sqrt(((shown - DrawnGel(dimming=6.0).colours(x, y, _normals())) ** 2).mean(axis=0))
    last = int(np.nonzero(whole.model.support.any(axis=1))[0].max())
    # From four degrees on a slope is taken to be in contact, which dims.
    rows = slice(6, last + 1)
    taught_bins = whole.model.support[rows, :-1]
    for kind in (taught_bins, ~taught_bins):
        off, said = found[rows, :-1][kind], whole.error[rows, :-1][kind]
        assert kind.sum() > 500
        assert (off < 2.0 * np.hypot(said, 1.0 / np.sqrt(12.0))).mean() > 0.95
        assert np.median(off / said) > 0.3


def _normals() -> FloatArray:
    """``(120, 120, 3)`` of the gel's surface in the middle of each bin."""
    slope, direction = np.meshgrid(
        (np.arange(120) + 0.5) * 0.5 * np.pi / 119,
        (np.arange(120) + 0.5) * 2.0 * np.pi / 119 - np.pi,
        indexing="ij",
    )
    return np.stack(
        [-np.sin(slope) * np.cos(direction), -np.sin(slope) * np.sin(direction), np.cos(slope)], axis=-1
    )


def test_more_presses_know_better(forty: PressPack, pair: tuple[Taught, Taught]) -> None:
    whole = taught(forty, np.arange(40), BALL)
    bins = reached(pair)["both"]
    half = np.sqrt(0.5 * (pair[0].error[bins] ** 2 + pair[1].error[bins] ** 2).mean())
    assert np.sqrt((whole.error[bins] ** 2).mean()) < 0.9 * half


def test_noise_makes_it_worse(pair: tuple[Taught, Taught]) -> None:
    noisy = taught(presses(40, noise=4.0), np.arange(0, 40, 2), BALL)
    bins = reached(pair)["both"]
    assert np.median(noisy.error[bins]) > 1.5 * np.median(pair[0].error[bins])


def test_the_seam_and_what_is_too_steep_are_as_in_the_table(pair: tuple[Taught, Taught]) -> None:
    for one in pair:
        last = int(np.nonzero(one.model.support.any(axis=1))[0].max())
        assert np.array_equal(one.error[:, -1], one.error[:, 0])
        assert (one.error[last:] == one.error[last]).all()
        assert np.isfinite(one.error).all()
        assert (one.error > 0.0).all()
