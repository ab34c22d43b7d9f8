"""The seven materials of the paper."""

from dataclasses import asdict, astuple
from pathlib import Path

import numpy as np
import pytest

from harness.basics.errors import WrongUse
from harness.basics.materials import KNOWN, MATERIALS, Material, Uncertainty, load_materials, material


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


GOOD = """
[materials.stoneware]
density = "2450 kg/m^3"
young = "45 GPa"
poisson = 0.2
alpha = "12 1/s"
beta = "0.1 us"
source = "ring-down of our own bowls"
"""

UNCERTAIN = """
[materials.stoneware.uncertainty]
density = "2 %"
young = "10 %"
poisson = "10 %"
alpha = "30 %"
beta = "50 %"
"""


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "materials.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_every_constant_has_a_source_and_an_uncertainty() -> None:
    assert set(KNOWN) == set(MATERIALS)
    for name, known in KNOWN.items():
        assert known.material is MATERIALS[name]
        assert "2019" in known.source
        assert known.basis
        assert known.uncertainty is not None
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
    assert known.uncertainty is not None
    ratio = np.log(published / asdict(known.material)[field])
    assert abs(ratio) <= 2.5 * asdict(known.uncertainty)[field]


def test_a_file_of_materials_is_read_in_si(tmp_path: Path) -> None:
    own = load_materials(written(tmp_path, GOOD))
    assert material("Stoneware", own) == Material("stoneware", 2450.0, 4.5e10, 0.2, 12.0, 1e-7)
    assert own["stoneware"].uncertainty is None
    assert own["stoneware"].source == "ring-down of our own bowls"
    assert material("steel", own) is MATERIALS["steel"]
    uncertain = load_materials(written(tmp_path, GOOD + UNCERTAIN))["stoneware"].uncertainty
    assert uncertain == Uncertainty(0.02, 0.1, 0.1, 0.3, 0.5)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (("young =", "yuong ="), "yuong"),
        (('"45 GPa"', "45e9"), "has no unit"),
        (('"45 GPa"', '"45 mm"'), "none of"),
        (("0.2", "0.5"), "poisson"),
        (('"12 1/s"', '"-12 1/s"'), "must not be negative"),
        (('source = "ring-down of our own bowls"', ""), "source"),
        (("[materials.stoneware]", "[materials.steel]"), "would replace a built-in"),
        (("[materials.stoneware]", "[materials.Stoneware]"), "lower case"),
        (("[materials.stoneware]", "[material.stoneware]"), "material"),
    ],
)
def test_a_mistake_in_a_file_of_materials_is_named(
    tmp_path: Path, change: tuple[str, str], told: str
) -> None:
    with pytest.raises(WrongUse, match=told):
        load_materials(written(tmp_path, GOOD.replace(*change)))


def test_an_uncertainty_is_whole_or_absent(tmp_path: Path) -> None:
    with pytest.raises(WrongUse, match="beta"):
        load_materials(written(tmp_path, GOOD + UNCERTAIN.replace('beta = "50 %"\n', "")))
    with pytest.raises(WrongUse, match="cannot be read"):
        load_materials(tmp_path / "none.toml")
