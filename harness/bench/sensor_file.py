"""What a tactile sensor's TOML file says: every figure with where it comes from."""

from typing import Annotated, Literal

from pydantic import Field

from harness.basics.quantities import Length, Positive
from harness.basics.toml_file import StrictModel

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


class ShadowStatement(Sourced):
    """Whether grazing light makes shadows worth simulating."""

    casts: bool


class SensorFile(StrictModel):
    """A description: see ``TactileSensor``. A flat gel has no radius, a plain one no dots.

    Attributes:
        schema_version: ``schema`` in the file.
        name: of the make.
        calibration: of its colours, a path beside this file or the name of a shipped one; None without.
        world_calibration: the same of other presses, which a mocked world shows; None without.
        image: of the camera.
        pitch: of a pixel.
        gel_thickness: of the gel.
        gel_radius: of a dome.
        housing: around the gel.
        markers: on the gel.
        shadow: in its light.
    """

    schema_version: Literal[1] = Field(alias="schema")
    name: Annotated[str, Field(min_length=1)]
    calibration: str | None = None
    world_calibration: str | None = None
    image: ImageFigure
    pitch: LengthFigure
    gel_thickness: LengthFigure
    gel_radius: LengthFigure | None = None
    housing: HousingFigure
    markers: MarkerFigure | None = None
    shadow: ShadowStatement
