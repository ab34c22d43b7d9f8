"""Quantities: every unit is the SI value times its factor; a bare or foreign number is refused."""

import math
from decimal import Decimal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.basics import quantities
from harness.basics.quantities import ANGLE, FORCE, LENGTH, RATIO, SPEED, TIME, Dimension

DIMENSIONS = [value for value in vars(quantities).values() if isinstance(value, Dimension)]


@pytest.mark.parametrize(
    ("dimension", "text", "value"),
    [
        (LENGTH, "1.2 mm", 1.2e-3),
        (LENGTH, "1.1mm", 0.0011),
        (LENGTH, " -0.5 m ", -0.5),
        (LENGTH, "25 µm", 25e-6),
        (LENGTH, "1e-3 m", 1e-3),
        (LENGTH, ".5 in", 0.0127),
        (ANGLE, "180 deg", math.pi),
        (ANGLE, "15 deg", 0.26179938779914943654),
        (SPEED, "10 mm/s", 0.01),
        (FORCE, "5 N", 5.0),
        (RATIO, "5 %", 0.05),
    ],
)
def test_a_quantity_is_the_nearest_float_to_its_si_value(
    dimension: Dimension, text: str, value: float
) -> None:
    assert dimension.parse(text) == value


SI_OF_ONE = {
    "a length": {"m": 1.0, "mm": 0.001, "cm": 0.01, "um": 0.000001, "µm": 0.000001, "in": 0.0254},
    "an angle": {"rad": 1.0, "deg": math.pi / 180.0, "mrad": 0.001},
    "a speed": {"m/s": 1.0, "mm/s": 0.001, "cm/s": 0.01},
    "an acceleration": {"m/s^2": 1.0, "mm/s^2": 0.001},
    "an angular speed": {"rad/s": 1.0, "deg/s": math.pi / 180.0},
    "an angular acceleration": {"rad/s^2": 1.0, "deg/s^2": math.pi / 180.0},
    "a force": {"N": 1.0, "mN": 0.001, "kN": 1000.0},
    "a mass": {"kg": 1.0, "g": 0.001},
    "a density": {"kg/m^3": 1.0, "g/cm^3": 1000.0},
    "a pressure": {"Pa": 1.0, "kPa": 1000.0, "MPa": 1000000.0, "GPa": 1000000000.0},
    "a time": {"s": 1.0, "ms": 0.001, "us": 0.000001, "µs": 0.000001, "min": 60.0},
    "a frequency": {"Hz": 1.0, "kHz": 1000.0, "MHz": 1000000.0},
    "a rate of decay": {"1/s": 1.0},
    "a share": {"1": 1.0, "%": 0.01},
    "a level": {"dB": 1.0},
    "a distance in the image": {"px": 1.0},
}
"""Written out, by the units' own definitions: a factor that is wrong in the table of units fails here."""


@pytest.mark.parametrize("dimension", DIMENSIONS, ids=lambda d: d.name)
def test_one_of_every_unit_is_what_the_unit_is_defined_as(dimension: Dimension) -> None:
    defined = SI_OF_ONE[dimension.name]
    assert set(dimension.factors) == set(defined)
    for unit, value in defined.items():
        assert dimension.parse(f"1 {unit}") == value, unit


@pytest.mark.parametrize("dimension", DIMENSIONS, ids=lambda d: d.name)
def test_the_example_of_a_dimension_reads(dimension: Dimension) -> None:
    assert math.isfinite(dimension.parse(dimension.example))


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_text_reads_back_to_the_same_bits(value: float) -> None:
    assert LENGTH.parse(LENGTH.text(value)) == value


@given(st.decimals(min_value=-1000, max_value=1000, places=6), st.sampled_from(["m", "cm", "mm", "um"]))
def test_units_agree(number: Decimal, unit: str) -> None:
    in_metres = number * Decimal(LENGTH.factors[unit])
    assert LENGTH.parse(f"{number} {unit}") == LENGTH.parse(f"{in_metres:f} m")


@pytest.mark.parametrize("bare", [5, 1.2, "5", "1.2e-3", " 7 "])
def test_a_bare_number_is_refused_because_its_unit_is_missing(bare: object) -> None:
    with pytest.raises(ValueError, match=r"no unit.*1\.2 mm"):
        LENGTH.parse(bare)


@pytest.mark.parametrize("text", ["5 kg", "1 MM", "3 mm/s", "4 1"])
def test_a_wrong_unit_names_the_accepted_ones(text: str) -> None:
    with pytest.raises(ValueError, match=r"unit .*m, mm, cm, um"):
        LENGTH.parse(text)


@pytest.mark.parametrize(
    "text",
    ["", "mm", "nan mm", "inf mm", "1,2 mm", "0x10 mm", "--1 mm", "2 mm extra", "4 m m", True, None, []],
)
def test_what_is_not_a_number_is_refused(text: object) -> None:
    with pytest.raises(ValueError, match="number"):
        LENGTH.parse(text)


def test_a_number_beyond_floating_point_is_refused() -> None:
    with pytest.raises(ValueError, match="1e999 m"):
        LENGTH.parse("1e999 m")


@pytest.mark.parametrize("mu", ["\u00b5", "\u03bc", "u"])
def test_micro_is_written_with_any_mu(mu: str) -> None:
    assert LENGTH.parse(f"12 {mu}m") == 12e-6
    assert TIME.parse(f"3{mu}s") == 3e-6
