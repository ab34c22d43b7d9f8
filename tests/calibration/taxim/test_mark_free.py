"""Calibration from drawn presses: what it recovers, what must not change it, and what it refuses."""

from dataclasses import replace

import numpy as np
import pytest

from calibration.taxim import mark_free
from calibration.taxim.held_out import held_out, teach
from calibration.taxim.mark_free import Identity, MarkFree, calibrate, check_order
from calibration.taxim.pictures import Pictures, PressPack
from calibration.taxim.smooth_fit import changes
from harness.basics.arrays import FloatArray
from harness.basics.errors import CalibrationRefused
from harness.sim.optics.optics import Optics, OpticsLevel
from tests.samples.drawn_presses import (
    BALL,
    COLUMNS,
    CONTACT,
    ROWS,
    DrawnGel,
    drawn_set,
    press_set,
    rounded,
    spread_centres,
)

WHO = Identity("drawn", "0", "none", "2026-01-01", pitch=1e-4, ball_radius=BALL * 1e-4)


@pytest.fixture(scope="module")
def twenty() -> tuple[Pictures, FloatArray, MarkFree]:
    pictures, centres = drawn_set(20, DrawnGel(dimming=6.0))
    return pictures, centres, calibrate(pictures, WHO)


def test_centres_are_found_to_a_tenth_of_a_pixel(twenty: tuple[Pictures, FloatArray, MarkFree]) -> None:
    _, centres, made = twenty
    assert len(made.used) == 20
    assert made.refused == ()
    apart = np.array([press.centre for press in made.used]) - centres
    assert np.abs(apart).max() < 0.1
    assert np.abs(apart.mean(axis=0)).max() < 0.03


def test_presses_left_out_are_drawn_almost_to_the_noise(
    twenty: tuple[Pictures, FloatArray, MarkFree],
) -> None:
    """Noise of one grey level, rounding and the model's own limits: 44 dB is 1.6 grey levels."""
    made = twenty[2]
    assert made.median("table") > 44.0
    assert made.median("unrefitted") > 43.0
    assert made.median("nothing") < 20.0
    assert made.calibration.header.held_out_table_db == made.median("table")
    assert made.calibration.header.held_out_db == made.median("smooth")
    assert made.calibration.header.misfit is not None
    assert 0.0 < made.calibration.header.misfit.rms < 1.6


def test_the_contact_line_is_a_circle_smaller_than_the_ball(
    twenty: tuple[Pictures, FloatArray, MarkFree],
) -> None:
    made = twenty[2]
    assert made.contact_radius == pytest.approx(CONTACT, abs=0.6)
    assert made.roundness < 0.1
    depth = BALL - np.sqrt(BALL**2 - CONTACT**2)
    assert np.median([press.depth for press in made.used]) == pytest.approx(depth * 1e-4, rel=0.25)


def test_the_artefact_draws_a_press_it_has_never_seen(twenty: tuple[Pictures, FloatArray, MarkFree]) -> None:
    """Through the renderer that everybody uses: heights in, picture out, at another place."""
    made, gel = twenty[2], DrawnGel(dimming=6.0, noise=0.0)
    centre = (57.3, 44.6)
    x, y = np.meshgrid(np.arange(COLUMNS), np.arange(ROWS))
    away = np.hypot(x - centre[0], y - centre[1])
    cap = np.sqrt(np.maximum(BALL**2 - away**2, 0.0)) - np.sqrt(BALL**2 - CONTACT**2)
    drawn = Optics(made.calibration, "exact").render(1e-4 * np.maximum(cap, 0.0)[None]).images[0]
    inside = (away < 0.85 * CONTACT) & (away > 1.5)
    left = drawn.astype(np.float64) - gel.press(centre, 0)
    assert np.sqrt(np.mean(left[inside] ** 2)) < 3.0
    assert np.array_equal(drawn[away > 2 * CONTACT], made.calibration.background[away > 2 * CONTACT])


def test_the_untouched_gel_is_the_background(twenty: tuple[Pictures, FloatArray, MarkFree]) -> None:
    made = twenty[2]
    levels: tuple[OpticsLevel, ...] = ("exact", "fast", "smooth")
    for level in levels:
        flat = Optics(made.calibration, level).render(np.zeros((1, ROWS, COLUMNS))).images[0]
        assert np.array_equal(flat, made.calibration.background)


@pytest.mark.slow  # a second fit of the same presses
def test_the_order_of_the_presses_changes_nothing(twenty: tuple[Pictures, FloatArray, MarkFree]) -> None:
    pictures, _, made = twenty
    order = np.random.default_rng(1).permutation(20)
    turned = replace(pictures, images=pictures.images[order], names=tuple(pictures.names[k] for k in order))
    again = calibrate(turned, WHO)
    assert again.calibration.sha256 == made.calibration.sha256
    assert {press.name: press for press in again.used} == {press.name: press for press in made.used}


@pytest.mark.slow  # a second fit of the same presses
def test_a_held_out_press_has_no_part_in_its_own_score(monkeypatch: pytest.MonkeyPatch) -> None:
    """Spoiling press 3 changes no score of its own fold, for which it is not taught; it changes others'."""
    monkeypatch.setattr("calibration.taxim.held_out.FOLDS", 4)
    pictures, centres = drawn_set(16)
    pack = PressPack(
        pictures.background, pictures.images, centres, np.full(16, CONTACT), np.arange(16), pictures.sha256
    )
    change = changes(pack)
    spoilt = change.copy()
    spoilt[3] *= 0.5
    before = held_out(pack, change, BALL, CONTACT).scores
    after = held_out(pack, spoilt, BALL, CONTACT).scores
    assert [after[k] for k in (7, 11, 15)] == [before[k] for k in (7, 11, 15)]
    assert after[3].table < before[3].table - 6.0
    assert all(after[k] != before[k] for k in range(16) if k % 4 != 3)


def test_a_smaller_ball_than_was_pressed_is_refused() -> None:
    pictures, _ = drawn_set(24)
    with pytest.raises(CalibrationRefused, match=r"8\.5 px.*7\.2 px"):
        calibrate(pictures, replace(WHO, ball_radius=0.6 * BALL * 1e-4))


def test_a_ball_in_no_proportion_to_the_picture_is_refused() -> None:
    pictures, _ = drawn_set(16)
    for radius in (1e-4, 80e-4):
        with pytest.raises(CalibrationRefused, match=r"0\.1 mm.*5 px.*48 px"):
            calibrate(pictures, replace(WHO, ball_radius=radius))


def test_a_press_of_something_else_is_refused_after_the_fit() -> None:
    """A dent where a bump should be: it looks like a ball, and is not this one."""
    pictures, centres = drawn_set(20)
    gel = DrawnGel()
    images = list(pictures.images)
    images[7] = rounded(2.0 * gel.rest() - gel.press((centres[7][0], centres[7][1]), 7))
    made = calibrate(replace(pictures, images=np.stack(images)), WHO)
    assert [(one.name, one.kind) for one in made.refused] == [("0007.png", "not explained")]
    assert "0007.png" not in {press.name for press in made.used}
    assert made.median("table") > 42.0


def test_marks_are_used_only_when_asked_and_must_fit_the_ball() -> None:
    pictures, centres = drawn_set(20)
    wild = np.column_stack([centres + 30.0, np.full(20, CONTACT)])
    too_large = np.column_stack([centres, np.full(20, BALL + 1.0)])
    plain = replace(pictures, marks=wild)
    found, _, refused = mark_free._usable(plain, BALL, use_marks=False)
    assert refused == []
    assert np.abs(found.centres - centres).max() < 1.5
    with pytest.raises(CalibrationRefused, match=r"20 of 20 .*0009\.png.*13\.0 px.*12\.0 px"):
        calibrate(replace(pictures, marks=too_large), WHO, use_marks=True)
    with pytest.raises(CalibrationRefused, match="--marks"):
        calibrate(pictures, WHO, use_marks=True)


def test_the_order_of_the_colours_is_held_to_a_sensor_of_the_same_make(
    twenty: tuple[Pictures, FloatArray, MarkFree],
) -> None:
    made = twenty[2].calibration
    check_order(made.smooth, made)
    with pytest.raises(CalibrationRefused, match=r"0\.13 .*1\.00 .*--channels bgr"):
        check_order(made.smooth[:, ::-1], made)
    with pytest.raises(CalibrationRefused, match=r"0\.06 .*0\.06 "):
        check_order(np.repeat(made.smooth.mean(axis=1, keepdims=True), 3, axis=1), made)


def test_what_the_presses_teach_is_no_more_than_their_places_cover() -> None:
    centres = spread_centres(16)
    gel = DrawnGel()
    pictures = press_set(
        [rounded(gel.press((x, y), k)) for k, (x, y) in enumerate(centres)], rounded(gel.rest())
    )
    pack = PressPack(
        pictures.background, pictures.images, centres, np.full(16, CONTACT), np.arange(16), pictures.sha256
    )
    model = teach(pack, changes(pack), BALL)
    steepest = model.circle.radius / BALL
    rows = np.nonzero(model.support.any(axis=1))[0]
    assert rows.max() < np.arcsin(steepest) / (0.5 * np.pi / 119)
    assert np.array_equal(model.table[rows.max() + 5], model.table[-1])
    assert not model.table[0].any()
