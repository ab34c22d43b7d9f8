"""The misfit that a calibration states is what held-out presses leave over, smooth, not the noise."""

from dataclasses import replace

import numpy as np
import pytest

from calibration.taxim.held_out import FittedModel, HeldOut, Score, colour_misfit, teach
from calibration.taxim.mark_free import Identity
from calibration.taxim.pictures import PressPack
from calibration.taxim.smooth_fit import changes, contact_pixels
from harness.basics.arrays import FloatArray
from tests.samples.drawn_presses import BALL, CONTACT, drawn_set
from tests.samples.smooth_colours import SmoothColours
from tests.samples.table_halves import packed

WHO = Identity("drawn", "0", "none", "2026-01-01", pitch=1e-4, ball_radius=BALL * 1e-4)
RADIUS = 0.95 * CONTACT
PRESSES = 20


@pytest.fixture(scope="module")
def drawn() -> tuple[PressPack, FloatArray, FittedModel, FloatArray]:
    """Presses, their changes, the model that they teach, and their true centres."""
    pictures, centres = drawn_set(PRESSES)
    pack = packed(pictures, centres, WHO)
    change = changes(pack)
    return pack, change, teach(pack, change, BALL), pack.centres


def left_out(model: FittedModel, centres: FloatArray) -> HeldOut:
    """All presses as one fold's, whose model is right."""
    score, nothing = Score(0.0, 0.0, 0.0, 0.0), np.zeros((1, 1))
    every = np.arange(PRESSES)
    return HeldOut([score] * PRESSES, nothing, nothing, centres, [(model, every, every)])


def off_by(
    drawn: tuple[PressPack, FloatArray, FittedModel, FloatArray], rms: float, alike: float
) -> FloatArray:
    """The changes of presses whose colours are off by a smooth function of the normal, another for each."""
    pack, change, _, centres = drawn
    moved = change.copy()
    for k, centre in enumerate(centres):
        place = contact_pixels(pack.shape, centre, CONTACT, 1)
        normal = (place[:, ::-1] - centre) / BALL
        moved[k][place[:, 0], place[:, 1]] += rms * SmoothColours(alike, seed=k).at(normal)
    return moved


@pytest.mark.parametrize(("rms", "alike"), [(4.0, 0.15), (8.0, 0.25)])
def test_a_smooth_misfit_is_found_beside_the_noise(
    drawn: tuple[PressPack, FloatArray, FittedModel, FloatArray], rms: float, alike: float
) -> None:
    pack, _, model, centres = drawn
    moved = off_by(drawn, rms, alike)
    moved += np.random.default_rng(1).normal(0.0, 4.0, moved.shape)
    found = colour_misfit(pack, moved, left_out(model, centres), BALL, RADIUS)
    assert found.rms == pytest.approx(rms, rel=0.25)
    assert found.alike == pytest.approx(alike, rel=0.35)


def test_noise_alone_is_no_misfit(drawn: tuple[PressPack, FloatArray, FittedModel, FloatArray]) -> None:
    pack, change, model, centres = drawn
    noisy = change + np.random.default_rng(1).normal(0.0, 6.0, change.shape)
    assert colour_misfit(pack, noisy, left_out(model, centres), BALL, RADIUS).rms < 1.5


def test_no_channel_and_no_order_of_the_presses_counts_more(
    drawn: tuple[PressPack, FloatArray, FittedModel, FloatArray],
) -> None:
    pack, _, model, centres = drawn
    moved, order = off_by(drawn, 5.0, 0.2), np.arange(PRESSES)[::-1]
    found = colour_misfit(pack, moved, left_out(model, centres), BALL, RADIUS)
    turned = left_out(model, centres[order])
    other = colour_misfit(pack.of(order), moved[order], turned, BALL, RADIUS)
    assert (other.rms, other.alike) == pytest.approx((found.rms, found.alike), rel=1e-6)
    by_colour = replace(
        model, rest=model.rest[..., ::-1], fit=replace(model.fit, colours=model.fit.colours[:, ::-1])
    )
    swapped = colour_misfit(pack, moved[..., ::-1], left_out(by_colour, centres), BALL, RADIUS)
    assert (swapped.rms, swapped.alike) == pytest.approx((found.rms, found.alike), rel=1e-6)
