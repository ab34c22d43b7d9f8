"""Quantities in files and options carry their unit: ``"1.2 mm"`` in the text, metres in the program."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal
from typing import Annotated, Any, TypeAlias

from pydantic import AfterValidator, GetCoreSchemaHandler
from pydantic_core import CoreSchema, core_schema

_TEXT = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([A-Za-zµ%]\S*|1(?:/\S+)?)?\s*")

_DEGREE = "0.017453292519943295769236907684886"


@dataclass(frozen=True, eq=False)
class Dimension:
    """What kind of quantity a number is, and in which units it may be written.

    ``Annotated[float, LENGTH]`` is a pydantic field that reads text with a unit and holds the
    SI value; as JSON it is text again.
    """

    name: str  #: with its article, as messages say it.
    factors: Mapping[str, str]
    """SI units in one of each unit, as decimal text; the first unit is the SI one."""
    example: str  #: as an operator would write it.

    @property
    def si(self) -> str:
        """The unit that the program computes in."""
        return next(iter(self.factors))

    def parse(self, text: object) -> float:
        """The SI value of a quantity written with its unit.

        Decimal arithmetic up to the last step, so that "1.1 mm" is the float nearest to 0.0011.

        Raises:
            ValueError: no number, no unit, a unit of something else, or a number too large.
        """
        # Keyboards write the prefix micro as a Greek mu too.
        match = _TEXT.fullmatch(text.replace("\u03bc", "\u00b5")) if isinstance(text, str) else None
        bare = isinstance(text, int | float) and not isinstance(text, bool)
        if bare or (match is not None and match.group(2) is None):
            raise ValueError(f"{text!r} has no unit; write {self.name} as {self._write()}")
        if match is None:
            raise ValueError(f"{text!r} is not a number and a unit; write {self.name} as {self._write()}")
        number, unit = match.groups()
        if unit not in self.factors:
            raise ValueError(f"{text!r} is not {self.name}: the unit {unit!r} is none of {self._units()}")
        value = float(Decimal(number) * Decimal(self.factors[unit]))
        if not math.isfinite(value):
            raise ValueError(f"{text!r} is too large to compute with; write {self.name} as {self._write()}")
        return value

    def text(self, value: float) -> str:
        """A value as text that reads back to the same bits."""
        return f"{float(value)!r} {self.si}"

    def __get_pydantic_core_schema__(self, _source: Any, _handler: GetCoreSchemaHandler) -> CoreSchema:
        written = core_schema.plain_serializer_function_ser_schema(self.text, when_used="json")
        return core_schema.no_info_plain_validator_function(self.parse, serialization=written)

    def _units(self) -> str:
        return ", ".join(self.factors)

    def _write(self) -> str:
        return f'"{self.example}" (units: {self._units()})'


def nonnegative(value: float) -> float:
    """``value``, or ``ValueError`` where it is below zero."""
    if value < 0.0:
        raise ValueError("it must not be negative")
    return value


def positive(value: float) -> float:
    """``value``, or ``ValueError`` where it is not above zero."""
    if value <= 0.0:
        raise ValueError("it must be above zero")
    return value


def ordered(pair: tuple[float, float]) -> tuple[float, float]:
    """A range, or ``ValueError`` where it ends below its beginning."""
    if pair[1] < pair[0]:
        raise ValueError("the second of the two is the upper end; exchange them")
    return pair


LENGTH = Dimension(
    "a length",
    {"m": "1", "mm": "1e-3", "cm": "1e-2", "um": "1e-6", "µm": "1e-6", "in": "0.0254"},
    "1.2 mm",
)
ANGLE = Dimension("an angle", {"rad": "1", "deg": _DEGREE, "mrad": "1e-3"}, "15 deg")
SPEED = Dimension("a speed", {"m/s": "1", "mm/s": "1e-3", "cm/s": "1e-2"}, "10 mm/s")
ACCELERATION = Dimension("an acceleration", {"m/s^2": "1", "mm/s^2": "1e-3"}, "0.5 m/s^2")
ANGULAR_SPEED = Dimension("an angular speed", {"rad/s": "1", "deg/s": _DEGREE}, "60 deg/s")
ANGULAR_ACCELERATION = Dimension(
    "an angular acceleration", {"rad/s^2": "1", "deg/s^2": _DEGREE}, "120 deg/s^2"
)
FORCE = Dimension("a force", {"N": "1", "mN": "1e-3", "kN": "1e3"}, "5 N")
MASS = Dimension("a mass", {"kg": "1", "g": "1e-3"}, "350 g")
DENSITY = Dimension("a density", {"kg/m^3": "1", "g/cm^3": "1e3"}, "2700 kg/m^3")
PRESSURE = Dimension("a pressure", {"Pa": "1", "kPa": "1e3", "MPa": "1e6", "GPa": "1e9"}, "72 GPa")
TIME = Dimension("a time", {"s": "1", "ms": "1e-3", "us": "1e-6", "µs": "1e-6", "min": "60"}, "50 ms")
FREQUENCY = Dimension("a frequency", {"Hz": "1", "kHz": "1e3", "MHz": "1e6"}, "500 Hz")
DECAY = Dimension("a rate of decay", {"1/s": "1"}, "6 1/s")
RATIO = Dimension("a share", {"1": "1", "%": "1e-2"}, "5 %")
LEVEL = Dimension("a level", {"dB": "1"}, "35 dB")
PIXELS = Dimension("a distance in the image", {"px": "1"}, "600 px")


Length: TypeAlias = Annotated[float, LENGTH]
Angle: TypeAlias = Annotated[float, ANGLE]
Speed: TypeAlias = Annotated[float, SPEED]
Acceleration: TypeAlias = Annotated[float, ACCELERATION]
AngularSpeed: TypeAlias = Annotated[float, ANGULAR_SPEED]
AngularAcceleration: TypeAlias = Annotated[float, ANGULAR_ACCELERATION]
Force: TypeAlias = Annotated[float, FORCE]
Time: TypeAlias = Annotated[float, TIME]
Frequency: TypeAlias = Annotated[float, FREQUENCY]
Decay: TypeAlias = Annotated[float, DECAY]
Ratio: TypeAlias = Annotated[float, RATIO]
Level: TypeAlias = Annotated[float, LEVEL]
Pixels: TypeAlias = Annotated[float, PIXELS]

# A check that comes after the unit is read, for fields that need one.
Nonnegative = AfterValidator(nonnegative)
Positive = AfterValidator(positive)
Ordered = AfterValidator(ordered)
