"""Tactile sensors described in TOML files: every figure with where it comes from."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from harness.basics.errors import WrongUse
from harness.basics.quantities import Length, Positive
from harness.basics.toml_file import StrictModel, load_toml, nearest
from harness.bench.sensor import MarkerGrid, TactileSensor

_SHIPPED = Path(__file__).parent / "data"
_PREFIX = "sensor_"

Count = Annotated[int, Field(gt=0)]


class Sourced(StrictModel):
    """A figure of a description and how it is known.

    Attributes:
        basis: measured on such a sensor, published by somebody, or assumed until measured.
        source: where, or why.
    """

    basis: Literal["measured", "published", "assumed"]
    source: Annotated[str, Field(min_length=10)]


class ImageFigure(Sourced):
    """Pixels."""

    rows: Count
    columns: Count


class LengthFigure(Sourced):
    """Metres."""

    value: Annotated[Length, Positive]


class HousingFigure(Sourced):
    """Metres, full size along the image's columns (x) and rows (y)."""

    x: Annotated[Length, Positive]
    y: Annotated[Length, Positive]


class MarkerFigure(Sourced):
    """Printed dots: see ``harness.bench.sensor.MarkerGrid``."""

    rows: Count
    columns: Count
    spacing: Annotated[Length, Positive]
    radius: Annotated[Length, Positive]


class ShadowFigure(Sourced):
    """Whether grazing light makes shadows worth simulating."""

    casts: bool


class SensorFile(StrictModel):
    """A description: see ``TactileSensor``. A flat gel has no radius, a plain one no dots."""

    schema_version: Literal[1] = Field(alias="schema")
    name: Annotated[str, Field(min_length=1)]
    image: ImageFigure
    pitch: LengthFigure
    gel_thickness: LengthFigure
    gel_radius: LengthFigure | None = None
    housing: HousingFigure
    markers: MarkerFigure | None = None
    shadow: ShadowFigure


@dataclass(frozen=True)
class SensorDescription:
    """A sensor, and how well its figures are known.

    Attributes:
        sensor: for the simulators and the inverse.
        sources: of every figure, by its table in the file.
        assumed: the tables whose figures are nobody's measurement: measure them before they matter.
    """

    sensor: TactileSensor
    sources: dict[str, str]
    assumed: tuple[str, ...]


def read_sensor(path: Path) -> SensorDescription:
    """Read a description, strictly.

    Raises:
        WrongUse: a key that is unknown, missing or of a wrong type or unit, each named; or a dome too flat or
            too small for what the camera sees.
    """
    said = load_toml(path, SensorFile)
    figures = {name: value for name, value in said if isinstance(value, Sourced)}
    sensor = TactileSensor(
        said.name,
        said.image.rows,
        said.image.columns,
        said.pitch.value,
        said.gel_thickness.value,
        None if said.gel_radius is None else said.gel_radius.value,
        (said.housing.x, said.housing.y),
        _markers(said.markers),
        said.shadow.casts,
    )
    _check(sensor, path)
    return SensorDescription(
        sensor,
        {name: figure.source for name, figure in figures.items()},
        tuple(name for name, figure in figures.items() if figure.basis == "assumed"),
    )


def shipped_sensors() -> tuple[str, ...]:
    """Names of the descriptions that come with the package."""
    return tuple(sorted(path.stem.removeprefix(_PREFIX) for path in _SHIPPED.glob(f"{_PREFIX}*.toml")))


def shipped_sensor(name: str) -> SensorDescription:
    """A description that comes with the package.

    Raises:
        WrongUse: no such name.
    """
    if name not in shipped_sensors():
        raise WrongUse(f"no sensor {name!r} is described; {nearest(name, shipped_sensors())}")
    return read_sensor(_SHIPPED / f"{_PREFIX}{name}.toml")


def _markers(said: MarkerFigure | None) -> MarkerGrid | None:
    return None if said is None else MarkerGrid(said.rows, said.columns, said.spacing, said.radius)


def _check(sensor: TactileSensor, path: Path) -> None:
    reach = 0.5 * max(sensor.window)
    if sensor.gel_radius is not None and sensor.gel_radius <= reach:
        raise WrongUse(
            f"{path}: a dome of {1e3 * sensor.gel_radius:g} mm radius does not span the window, which "
            f"reaches {1e3 * reach:.1f} mm from its centre; check [gel_radius], [pitch] and [image]"
        )
    for side, window, housing in zip("xy", sensor.window, sensor.housing, strict=True):
        if window > housing:
            raise WrongUse(
                f"{path}: the camera sees {1e3 * window:.1f} mm along {side} of a housing of "
                f"{1e3 * housing:g} mm; check [pitch], [image] and [housing]"
            )
