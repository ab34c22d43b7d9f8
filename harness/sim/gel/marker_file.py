"""Where the dots of one gel are, as they were measured: a JSON file that simulators and trackers read.

A sensor's description has a grid of dots, centred and straight (``harness.bench.sensor.MarkerGrid``). A
print is off by a pixel, turned by a degree, and a dot is missing here and there; this file has every dot of
the very gel.
"""

from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from harness.basics.arrays import FloatArray, read_only
from harness.basics.errors import OutOfDomain
from harness.basics.files.json_file import read_model
from harness.basics.toml_file import StrictModel
from harness.bench.sensor import MarkerGrid

Finite = Annotated[float, Field(allow_inf_nan=False)]
Above = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Count = Annotated[int, Field(gt=0)]


class MarkerDot(StrictModel):
    """One dot of a resting gel."""

    row: Annotated[int, Field(ge=0)]  #: of the grid, downwards from 0.
    column: Annotated[int, Field(ge=0)]  #: of the grid, to the right from 0.
    x_px: Finite  #: pixels, column of its middle in the picture.
    y_px: Finite  #: pixels, row.
    sigma_px: Above  #: pixels, one standard uncertainty of either.
    radius_px: Above  #: pixels.


class MarkerFile(StrictModel):
    """Every dot of a gel."""

    schema_number: Literal[1] = Field(alias="schema")  #: of the file.
    sensor: str  #: make.
    serial: str  #: of the very gel.
    made_from: str  #: the pictures, by their hash.
    picture_rows: Count  #: pixels.
    picture_columns: Count  #: pixels.
    pitch_m: Above | None  #: m a pixel; None where nothing told it.
    ink: Annotated[float, Field(ge=0.0, le=1.0)]  #: share of the light that a dot gives back.
    rows: Count  #: of the grid.
    columns: Count  #: of the grid.
    spacing_px: Above  #: pixels from dot to dot.
    turned_rad: Finite  #: rad, of the grid's rows in the picture.
    dots: Annotated[list[MarkerDot], Field(min_length=1)]  #: those that are in the picture.

    @property
    def places(self) -> FloatArray:
        """``(dots, 2)`` pixels (column, row)."""
        return read_only(np.array([(dot.x_px, dot.y_px) for dot in self.dots]))

    @property
    def radius(self) -> float:
        """Pixels, median over the dots."""
        return float(np.median([dot.radius_px for dot in self.dots]))

    def in_gel(self, pitch: float | None = None) -> FloatArray:
        """``(dots, 2)`` metres, x and y in ``gel``.

        Args:
            pitch: m a pixel, where the file has none or another is wanted.

        Raises:
            OutOfDomain: no pitch is known.
        """
        scale = self._pitch(pitch)
        middle = 0.5 * np.array([self.picture_columns, self.picture_rows]) - 0.5
        return read_only((self.places - middle) * scale)

    def grid(self, pitch: float | None = None) -> MarkerGrid:
        """The centred, straight grid that comes nearest, for a sensor's description; raises as ``in_gel``."""
        scale = self._pitch(pitch)
        return MarkerGrid(self.rows, self.columns, self.spacing_px * scale, self.radius * scale)

    def _pitch(self, pitch: float | None) -> float:
        scale = self.pitch_m if pitch is None else pitch
        if scale is None:
            raise OutOfDomain(
                "no millimetres a pixel are known of these dots; calibrate them with --pitch, or with "
                "--spacing of the print"
            )
        return scale


def read_markers(path: Path) -> MarkerFile:
    """The file that ``touchstone calibrate markers`` wrote; raises as ``read_model``."""
    return read_model(path, MarkerFile, "file of markers", "give what `touchstone calibrate markers` wrote")
