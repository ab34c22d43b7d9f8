"""The seven materials of the paper."""

from dataclasses import asdict, astuple

import numpy as np
import pytest

from harness.basics.errors import WrongUse
from harness.basics.materials import KNOWN, MATERIALS, material


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
    with pytest.raises(WrongUse, match=r"'ceramics'.*'ceramic'"):
        material("ceramics")


def test_every_constant_has_a_source_and_an_uncertainty() -> None:
    assert set(KNOWN) == set(MATERIALS)
    for name, known in KNOWN.items():
        assert known.material is MATERIALS[name]
        assert "2019" in known.source
        assert known.basis
        for sigma in astuple(known.uncertainty):
            assert 0.0 < sigma < 1.0


@pytest.mark.parametrize(
    ("name", "field", "published"),
    [
        ("ceramic", "alpha", 15.0),
        ("ceramic", "beta", 2e-8),
        ("ceramic", "young", 7.055e10),
        ("plastic", "alpha", 20.0),
        ("plastic", "beta", 3e-7),
        ("iron", "alpha", 10.0),
        ("steel", "alpha", 20.0),
        ("glass", "young", 7.0e10),
        ("steel", "young", 1.93e11),
        ("wood", "density", 640.0),
        ("iron", "density", 7200.0),
    ],
)
def test_what_others_publish_is_within_two_and_a_half_deviations(
    name: str, field: str, published: float
) -> None:
    known = KNOWN[name]
    ratio = np.log(published / asdict(known.material)[field])
    assert abs(ratio) <= 2.5 * asdict(known.uncertainty)[field]
