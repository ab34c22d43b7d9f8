"""Places of options: metres, or lengths with their units; a vertex; and clear words where it is none."""

import numpy as np
import pytest

from harness.basics.errors import OutOfDomain, WrongUse
from harness.commands.places import point
from harness.objects.builtin import build
from harness.tasks.touch import find_place

MUG = build("mug")


def test_a_number_is_metres_and_a_length_says_its_own_unit() -> None:
    assert (
        point("--at", ("-0.04", "0", "50mm"))
        == point("--at", ("-40 mm", "0 cm", "0.05"))
        == (-0.04, 0.0, 0.05)
    )


@pytest.mark.parametrize("text", ["nan", "inf", "5kg", "five", "", "1e400"])
def test_what_is_no_coordinate_is_refused_by_its_option(text: str) -> None:
    with pytest.raises(WrongUse, match=r"^--at"):
        point("--at", ("0", text, "0"))


def test_a_vertex_is_a_place_of_the_surface() -> None:
    place = find_place(MUG, None, 7)
    assert place.point == pytest.approx(MUG.vertices[7])
    assert np.linalg.norm(place.normal) == pytest.approx(1.0)


@pytest.mark.parametrize("vertex", [-1, len(MUG.vertices)])
def test_a_vertex_that_there_is_not_is_named(vertex: int) -> None:
    with pytest.raises(OutOfDomain, match=f"{vertex}.* {len(MUG.vertices)}"):
        find_place(MUG, None, vertex)


def test_one_of_the_two_is_wanted() -> None:
    with pytest.raises(WrongUse, match=r"--contact X Y Z.*--vertex N"):
        find_place(MUG, None, None)
    with pytest.raises(WrongUse, match=r"--contact X Y Z.*--vertex N"):
        find_place(MUG, (0.0, 0.0, 0.0), 1)
