"""Dots printed on a gel: how well drawn ones are placed, which is which, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from calibration.markers.at_rest import Printed, lay_lattice, markers_at_rest
from calibration.markers.dots import Dots, find_dots, relative_light
from harness.basics.arrays import FloatArray
from harness.basics.errors import CalibrationRefused, OutOfDomain
from tests.samples.drawn_dots import COLUMNS, ROWS, DrawnDots, gel

CASES = {
    "plain": DrawnDots(),
    "no noise": DrawnDots(noise=0.0),
    "noisy": DrawnDots(noise=4.0),
    "blurred": DrawnDots(blur=1.5),
    "sharp": DrawnDots(blur=0.3),
    "grey ink": DrawnDots(ink=0.75, noise=3.0),
    "large": DrawnDots(radius=10.0),
    "small": DrawnDots(radius=2.5, spacing=12.0, wide=15, high=11),
    "turned": DrawnDots(turned=0.4, wide=7, high=6),
    "barrel": DrawnDots(barrel=6.0),
}


def errors(dots: Dots, truth: FloatArray) -> FloatArray:
    """``(n, 2)`` pixels, of every dot against the nearest true one."""
    away, at = cKDTree(truth).query(dots.places)
    assert np.max(away) < 1.0
    return np.asarray(dots.places - truth[at])


@pytest.mark.parametrize("drawn", CASES.values(), ids=CASES.keys())
def test_dots_are_placed_to_some_hundredths_of_a_pixel(drawn: DrawnDots) -> None:
    dots = find_dots(drawn.picture(seed=3))
    assert len(dots.places) == drawn.wide * drawn.high
    assert dots.cut == 0
    off = errors(dots, drawn.places())
    assert np.sqrt(np.mean(off**2)) < 0.025
    assert np.abs(off).max() < 0.1
    # Without bias: the mean of n dots is known to one over the root of n.
    assert np.abs(off.mean(axis=0)).max() < 4.0 * np.sqrt(np.mean(off**2) / len(off))


def test_a_camera_of_more_pixels_sees_the_same_light() -> None:
    """Beyond 1,544 rows a median over a quarter of them would count beyond 16 bits."""
    picture = DrawnDots().picture()
    fine = np.repeat(np.repeat(picture, 7, axis=0), 7, axis=1)
    assert len(fine) > 1544
    off = relative_light(fine)[3::7, 3::7] - relative_light(picture)
    assert np.sqrt(np.mean(off**2)) < 0.01


def test_errors_are_what_they_are_said_to_be() -> None:
    over = []
    for seed in range(4):
        drawn = DrawnDots(noise=1.0 + seed)
        dots = find_dots(drawn.picture(seed=seed))
        over.append(errors(dots, drawn.places()) / dots.sigma[:, None])
    # 560 numbers: their spread is known to 3 %; the model's own limits are allowed half as much again.
    assert 0.6 < np.sqrt(np.mean(np.square(over))) < 1.5


@pytest.mark.parametrize("blur", [0.3, 0.7, 1.5])
def test_radius_and_ink_are_the_drawn_ones_however_blurred(blur: float) -> None:
    drawn = DrawnDots(blur=blur)
    dots = find_dots(drawn.picture())
    assert np.median(dots.radius) == pytest.approx(drawn.radius, abs=0.03)
    assert np.median(dots.ink) == pytest.approx(drawn.ink, abs=0.01)


def test_every_dot_has_its_row_and_column_though_some_are_missing_and_a_lens_bends_them() -> None:
    drawn = DrawnDots(barrel=8.0, turned=-0.05)
    places = drawn.places()
    gone = [0, 23, 24, 45]
    kept = np.delete(np.arange(len(places)), gone)
    dots = find_dots(drawn.picture(places[kept]))
    lattice = lay_lattice(dots.places)
    at = kept[cKDTree(places[kept]).query(dots.places)[1]]
    assert np.array_equal(lattice.index, np.column_stack([at % drawn.wide, at // drawn.wide]))
    assert {tuple(one) for one in lattice.missing} == {(k % drawn.wide, k // drawn.wide) for k in gone}
    assert (lattice.columns, lattice.rows) == (drawn.wide, drawn.high)


def test_a_lens_is_told_from_a_misprint() -> None:
    drawn = DrawnDots(barrel=6.0)
    places = drawn.places()
    places[33] += (1.2, -0.9)
    lattice = lay_lattice(find_dots(drawn.picture(places)).places)
    off = np.hypot(*lattice.local.T)
    worst = int(np.argmax(off))
    assert tuple(lattice.index[worst]) == (3, 3)
    assert off[worst] == pytest.approx(1.5, abs=0.1)
    assert np.delete(off, worst).max() < 0.1
    assert np.hypot(*lattice.affine.T).max() > 1.0


def test_specks_glints_and_dots_at_the_border_do_no_harm() -> None:
    drawn = DrawnDots(wide=12, high=9, spacing=29.0)
    picture = drawn.picture().copy()
    truth = drawn.places()
    picture[40:43, 60:62] = 20
    x, y = np.round(truth[50]).astype(int)
    picture[y - 3 : y, x + 1 : x + 4] = 250
    dots = find_dots(picture)
    assert dots.cut > 0
    off = errors(dots, truth)
    glint = int(np.argmin(np.hypot(*(dots.places - truth[50]).T)))
    assert np.abs(np.delete(off, glint, axis=0)).max() < 0.05
    assert np.abs(off[glint]).max() < 0.3
    inside = (np.abs(truth - 0.5 * np.array([COLUMNS, ROWS])) < 0.5 * np.array([COLUMNS, ROWS]) - 9.0).all(
        axis=1
    )
    assert len(dots.places) >= inside.sum()


def test_the_print_tells_pitch_aspect_and_rotation() -> None:
    drawn = DrawnDots(aspect=1.03, turned=0.015)
    made = markers_at_rest([drawn.picture(seed=k) for k in range(2)], Printed(spacing=1.45e-3))
    scale = made.scale
    assert scale is not None
    assert made.pitch == scale.pitch.value
    assert scale.pitch.value == pytest.approx(1.45e-3 / 29.0, rel=2e-4)
    assert scale.aspect.value == pytest.approx(1.03, abs=2e-4)
    assert scale.rotation.value == pytest.approx(-0.015, abs=2e-4)
    assert 0.0 < scale.aspect.within95 < 1e-3


def test_several_pictures_say_how_far_a_place_wanders() -> None:
    pictures = [DrawnDots(noise=3.0).picture(seed=k) for k in range(3)]
    alone = markers_at_rest(pictures[:1], Printed())
    together = markers_at_rest(pictures, Printed())
    assert alone.wander is None
    assert together.wander is not None
    # From noise alone, and the same in every picture: what one picture says of itself.
    assert 0.4 < together.wander / np.median(alone.dots.sigma) < 1.5
    assert np.median(together.dots.sigma) < np.median(alone.dots.sigma)


def touched(drawn: DrawnDots, depth: float = 5.0) -> FloatArray:
    """Places of dots about a contact, drawn outwards."""
    places = drawn.places()
    away = places - np.array([150.0, 110.0])
    far = np.hypot(away[:, 0], away[:, 1])
    spread = depth * (far / 30.0) * np.exp(0.5 - 0.5 * (far / 30.0) ** 2)
    moved: FloatArray = places + away * (spread / np.maximum(far, 1e-9))[:, None]
    return moved


def test_a_touched_gel_is_refused_with_its_place() -> None:
    drawn = DrawnDots()
    with pytest.raises(CalibrationRefused, match=r"179\D+87\b"):
        markers_at_rest([drawn.picture(touched(drawn))], Printed())


def test_pictures_between_which_the_sensor_moved_are_refused() -> None:
    drawn = DrawnDots()
    pictures = [drawn.picture(), replace(drawn, middle=(161.3, 118.8)).picture()]
    with pytest.raises(CalibrationRefused, match=r"0\.50 px.*0\.25"):
        markers_at_rest(pictures, Printed())


def test_an_unmarked_gel_is_refused() -> None:
    plain = np.round(gel() + np.random.default_rng(0).normal(0.0, 2.0, gel().shape)).astype(np.uint8)
    with pytest.raises(CalibrationRefused, match=r"1 %.*15 %"):
        find_dots(plain)


def test_dots_strewn_about_are_refused() -> None:
    draw = np.random.default_rng(1)
    places: list[FloatArray] = []
    while len(places) < 40:
        one = draw.uniform((15.0, 15.0), (COLUMNS - 15.0, ROWS - 15.0))
        if all(np.hypot(*(one - other)) > 16.0 for other in places):
            places.append(one)
    with pytest.raises(CalibrationRefused, match=r"0\.11 .*0\.6 "):
        lay_lattice(find_dots(DrawnDots().picture(np.array(places))).places)


def test_too_few_dots_too_small_dots_and_other_sizes_are_refused() -> None:
    few = DrawnDots(wide=3, high=3)
    with pytest.raises(CalibrationRefused, match=r"\b9 .*\b12 "):
        lay_lattice(find_dots(few.picture()).places)
    line = DrawnDots(wide=10, high=2)
    with pytest.raises(CalibrationRefused, match=r"0\.50 .*0\.6 "):
        lay_lattice(find_dots(line.picture()).places)
    small = DrawnDots(radius=1.4, blur=0.3, spacing=10.0, wide=20, high=15, noise=0.5, ink=0.0)
    with pytest.raises(CalibrationRefused, match=r"1\.\d px.*1\.5 px"):
        find_dots(small.picture())
    picture = DrawnDots().picture()
    with pytest.raises(CalibrationRefused, match=r"320 x 239.*320 x 240"):
        markers_at_rest([picture, picture[1:]], Printed())
    with pytest.raises(OutOfDomain, match="picture"):
        markers_at_rest([], Printed())
    with pytest.raises(OutOfDomain, match=r"pitch.*spacing"):
        markers_at_rest([picture], Printed(pitch=1e-4, spacing=1e-3))
