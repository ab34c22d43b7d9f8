"""Presses seen in pixels that are not square: what a fit makes of them as they are, and made square.

The gel is drawn by formula, so the colour of any slope is known. That colour is looked for in the
calibration: the slope at which it is found, over the true one, is 1 where rows and columns are right.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from calibration.taxim.mark_free import Identity, MarkFree, calibrate
from calibration.taxim.pictures import squared
from harness.basics.arrays import FloatArray
from harness.basics.errors import OutOfDomain
from harness.picture.square_pixels import square_places
from harness.sim.optics.shading import design
from tests.samples import drawn_presses
from tests.samples.drawn_presses import BALL, COLUMNS, ROWS, DrawnGel, drawn_set

WHO = Identity("drawn", "0", "none", "2026-01-01", pitch=1e-4, ball_radius=BALL * 1e-4)
TALL = 1.03
SLOPE = 0.4


def colour(normal: FloatArray) -> FloatArray:
    """By the drawn gel's own lights, in the middle of the picture."""
    lit = np.array([*normal, np.sqrt(1.0 - normal @ normal)]) @ drawn_presses.LIGHTS.T
    shown: FloatArray = drawn_presses._GAIN * (lit - drawn_presses.LIGHTS[:, 2])
    return shown


def found_over_true(made: MarkFree, axis: int) -> float:
    """Along columns (0) or rows (1): the drawn slope whose colour ``SLOPE`` is given, over ``SLOPE``."""
    each = []
    for sign in (-1.0, 1.0):
        normal = np.zeros(2)
        normal[axis] = sign * SLOPE
        shown = (design(normal[None], np.zeros((1, 2))) @ made.calibration.smooth)[0]

        def apart(share: float, normal: FloatArray = normal, shown: FloatArray = shown) -> float:
            return float(((colour(share * normal) - shown) ** 2).sum())

        each.append(minimize_scalar(apart, bounds=(0.8, 1.25), method="bounded").x)
    return float(np.mean(each))


@pytest.fixture(scope="module")
def made() -> dict[str, MarkFree]:
    seen, _ = drawn_set(24, DrawnGel(aspect=TALL))
    plain, _ = drawn_set(24)
    return {
        "plain": calibrate(plain, WHO),
        "as seen": calibrate(seen, WHO),
        "square": calibrate(squared(seen, TALL), WHO),
    }


@pytest.mark.slow  # fits three sets of 24 presses
def test_as_seen_the_slopes_of_rows_and_columns_are_apart_by_the_aspect(made: dict[str, MarkFree]) -> None:
    ratio = found_over_true(made["as seen"], 1) / found_over_true(made["as seen"], 0)
    ground = found_over_true(made["plain"], 1) / found_over_true(made["plain"], 0)
    assert ratio / ground == pytest.approx(TALL, abs=0.005)


@pytest.mark.slow
def test_made_square_they_are_as_on_a_sensor_of_square_pixels(made: dict[str, MarkFree]) -> None:
    for axis in (0, 1):
        square, plain = (found_over_true(made[which], axis) for which in ("square", "plain"))
        assert square == pytest.approx(plain, abs=0.005)
        assert square == pytest.approx(1.0, abs=0.01)


@pytest.mark.slow
def test_the_contact_line_is_a_circle_again(made: dict[str, MarkFree]) -> None:
    """An ellipse of 3 % strays from a circle of 8.7 px by a tenth of a pixel."""
    assert made["as seen"].roundness > 0.07
    assert made["square"].roundness < 0.05


@pytest.mark.slow
def test_presses_are_found_where_they_are_in_the_square_picture(made: dict[str, MarkFree]) -> None:
    _, centres = drawn_set(24, DrawnGel(aspect=TALL))
    wanted = square_places(centres, ROWS, COLUMNS, TALL)
    found = np.array([press.centre for press in made["square"].used])
    assert np.abs(found - wanted).max() < 0.1
    assert made["square"].median("table") > 44.0


@pytest.mark.slow
def test_the_artefact_says_by_what_the_pictures_were_made_square(made: dict[str, MarkFree]) -> None:
    assert "made square by 1.03000" in made["square"].calibration.header.made_from
    assert "square" not in made["as seen"].calibration.header.made_from


def test_marks_go_with_the_pictures_and_one_changes_nothing() -> None:
    seen, centres = drawn_set(4)
    marked = replace(seen, marks=np.column_stack([centres, np.full(4, 9.0)]))
    moved = squared(marked, TALL)
    assert moved.marks is not None
    assert moved.marks[:, :2] == pytest.approx(square_places(centres, ROWS, COLUMNS, TALL))
    assert moved.marks[:, 2] == pytest.approx(9.0)
    assert moved.sha256 == seen.sha256
    assert squared(seen, 1.0) is seen
    with pytest.raises(OutOfDomain, match=r"\b3 .*0\.5 to 2 "):
        squared(seen, 3.0)
