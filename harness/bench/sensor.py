"""Tactile cameras: the geometry that simulators know of a make, read from the make's own file.

A make is one TOML file (``harness.bench.sensor``): a shipped one goes by its name, any other by its
path.
"""

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from harness.basics.errors import WrongUse
from harness.basics.files.named_file import nearest, real_path
from harness.basics.quantities import Length, Positive
from harness.basics.toml_file import StrictModel, load_toml

Count = Annotated[int, Field(gt=0)]


class Sourced(StrictModel):
    """A figure of a description and how it is known."""

    basis: Literal["measured", "published", "assumed"]
    """measured on such a sensor, published by somebody, or assumed until measured."""
    source: Annotated[str, Field(min_length=10)]  #: where, or why.


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


class ShadowStatement(Sourced):
    """Whether grazing light makes shadows worth simulating."""

    casts: bool


class SensorFile(StrictModel):
    """A description: see ``TactileSensor``. A flat gel has no radius, a plain one no dots."""

    schema_version: Literal[1] = Field(alias="schema")  #: ``schema`` in the file.
    name: Annotated[str, Field(min_length=1)]  #: of the make.
    calibration: str | None = None
    """of its colours, a path beside this file or the name of a shipped one; None without."""
    world_calibration: str | None = None
    """the same of other presses, which a mocked world shows; None without."""
    image: ImageFigure  #: of the camera.
    pitch: LengthFigure  #: of a pixel.
    gel_thickness: LengthFigure  #: of the gel.
    gel_radius: LengthFigure | None = None  #: of a dome.
    housing: HousingFigure  #: around the gel.
    markers: MarkerFigure | None = None  #: on the gel.
    shadow: ShadowStatement  #: in its light.


_SHIPPED = Path(__file__).parent / "sensors"

DEFAULT_MAKE = "gelsight-r1.5"


@dataclass(frozen=True)
class MarkerGrid:
    """Printed dots on the gel: count, spacing and radius."""

    key_name: ClassVar[str] = "harness.bench.sensor.MarkerGrid"

    rows: int  #: dots along the image's rows (downwards).
    columns: int  #: dots along the image's columns.
    spacing: float  #: metres between neighbours.
    radius: float  #: metres.


@dataclass(frozen=True)
class TactileSensor:
    """A gel with a camera behind it.

    The ``gel`` frame has its origin at the centre of the undeformed gel surface, z out of
    the sensor towards the object, x along image columns, y along image rows. Pixel
    (row i, column j) has its centre at x = (j + 0.5 - columns / 2) * pitch,
    y = (i + 0.5 - rows / 2) * pitch.
    """

    key_name: ClassVar[str] = "harness.bench.sensor.TactileSensor"

    name: str  #: of the make.
    rows: int  #: pixels.
    columns: int  #: pixels.
    pitch: float  #: metres a pixel.
    gel_thickness: float  #: metres; no press may be deeper.
    gel_radius: float | None = None  #: metres, of a dome that bulges towards the object; None for a flat gel.
    housing: tuple[float, float] = (0.034, 0.030)
    """metres (x, y): full size of the flat face around the gel."""
    markers: MarkerGrid | None = None  #: the dots printed on the gel, None where there are none.
    casts_shadow: bool = False  #: whether a grazing light makes shadows worth simulating.

    @property
    def window(self) -> tuple[float, float]:
        """Metres (x, y): the area the camera sees."""
        return self.columns * self.pitch, self.rows * self.pitch


@dataclass(frozen=True)
class SensorDescription:
    """A make of tactile camera, and how well its figures are known."""

    sensor: TactileSensor  #: for the simulators and the inverse.
    calibration: str | None
    """of its colours: an absolute path or the name of a shipped one; None where none comes with it."""
    world_calibration: str | None
    """the same of other presses, for the mocked world; None where there are none."""
    sources: dict[str, str]  #: of every figure, by its table in the file.
    assumed: tuple[str, ...]
    """the tables whose figures are nobody's measurement: measure them before they matter."""


def shipped_sensors() -> tuple[str, ...]:
    """Names of the makes that come with the package."""
    return tuple(sorted(path.stem for path in _SHIPPED.glob("*.toml")))


def sensor_path(make: str, folder: Path | None = None) -> Path:
    """The file of a make: a shipped name, or a path (relative to ``folder``; to here if None).

    Raises:
        WrongUse: there is none.
    """
    if make in shipped_sensors():
        return _SHIPPED / f"{make}.toml"
    path = (folder or Path()) / make
    if not path.is_file():
        listed = nearest(make, shipped_sensors())
        raise WrongUse(f"no sensor {make!r}; {listed}; or give the path of a sensor's file")
    return real_path(path)


def described_sensor(make: str) -> SensorDescription:
    """A make by its shipped name or the path of its file.

    Raises:
        WrongUse: there is none, or as ``read_sensor``.
    """
    path = sensor_path(make)
    return _shipped(path) if path.parent == _SHIPPED else read_sensor(path)


def read_sensor(path: Path) -> SensorDescription:
    """Read a description, strictly.

    Raises:
        WrongUse: a key that is unknown, missing or of a wrong type or unit, each named; or a dome too flat or
            too small for what the camera sees.
    """
    said = load_toml(path, SensorFile)
    figures = {name: value for name, value in said if isinstance(value, Sourced)}
    dots = said.markers
    sensor = TactileSensor(
        said.name,
        said.image.rows,
        said.image.columns,
        said.pitch.value,
        said.gel_thickness.value,
        None if said.gel_radius is None else said.gel_radius.value,
        (said.housing.x, said.housing.y),
        None if dots is None else MarkerGrid(dots.rows, dots.columns, dots.spacing, dots.radius),
        said.shadow.casts,
    )
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
    return SensorDescription(
        sensor,
        _beside(path, said.calibration),
        _beside(path, said.world_calibration),
        {name: figure.source for name, figure in figures.items()},
        tuple(name for name, figure in figures.items() if figure.basis == "assumed"),
    )


@cache
def _shipped(path: Path) -> SensorDescription:
    """Read once: what comes with the package does not change while it runs."""
    return read_sensor(path)


def _beside(path: Path, calibration: str | None) -> str | None:
    if calibration is None:
        return None
    beside = path.parent / calibration
    return str(real_path(beside)) if beside.is_file() else calibration


GELSIGHT_R15 = described_sensor(DEFAULT_MAKE).sensor
"""The paper's own sensor: 120 x 160 pixels of 0.1245 mm, a window of 19.9 x 14.9 mm."""
