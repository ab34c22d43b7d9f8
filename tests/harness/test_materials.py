"""The seven materials of the paper."""

import numpy as np
import pytest

from harness.errors import WrongUse
from harness.materials import MATERIALS, material


def test_there_are_the_seven_of_the_paper() -> None:
    assert set(MATERIALS) == {"ceramic", "glass", "wood", "plastic", "iron", "polycarbonate", "steel"}
    for name, constants in MATERIALS.items():
        assert constants.name == name
        assert 0.0 < constants.poisson < 0.5


@pytest.mark.parametrize(
    ("name", "decay"),
    [("steel", 3.1), ("ceramic", 5.0), ("wood", 69.5), ("polycarbonate", 8.1), ("plastic", 34.7)],
)
def test_decay_at_1_khz_is_that_of_the_material(name: str, decay: float) -> None:
    found = material(name)
    assert (found.alpha + found.beta * (2 * np.pi * 1e3) ** 2) / 2 == pytest.approx(decay, abs=0.06)


def test_names_are_read_in_any_case_and_the_nearest_is_named() -> None:
    assert material(" Ceramic ").density == 2700.0
    with pytest.raises(WrongUse, match="did you mean 'ceramic'"):
        material("ceramics")
