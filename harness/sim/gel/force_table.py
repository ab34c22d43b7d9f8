"""Forces measured on a gel, by how much of it an object takes: a JSON file, read between its rows only.

An arm presses an object of one kind, reads its force sensor, and writes how deep it was, or how much
volume it took of the gel. A table by depth holds for that very object; one by volume is nearly the
same for objects of like breadth.
"""

from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator
from scipy.interpolate import PchipInterpolator

from harness.basics.arrays import FloatArray
from harness.basics.errors import OutOfDomain
from harness.basics.files.json_file import read_model
from harness.basics.toml_file import StrictModel

Above = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Said = Annotated[str, Field(min_length=1)]

_UNITS = {"depth_m": (1e3, "mm deep"), "volume_m3": (1e9, "mm^3 of the gel taken")}


class ForceRow(StrictModel):
    """What was measured at one depth."""

    at: Above  #: metres, or cubic metres, by the table's ``of``.
    force_n: Above  #: N, mean of the readings.
    sigma_n: Above
    """N, one standard deviation of a press from that mean: the scatter of repeated presses, with the force
    sensor's own uncertainty."""


class ForceTable(StrictModel):
    """Forces of one gel and one kind of object, least first."""

    schema_number: Literal[1] = Field(alias="schema")  #: of the file.
    sensor: Said  #: make.
    serial: str  #: of the very gel.
    indenter: Said  #: what was pressed, in words.
    made_from: Said  #: the readings.
    of: Literal["depth_m", "volume_m3"]
    """what ``at`` is: the deepest pixel, or the volume between the object and the untouched gel."""
    rows: Annotated[list[ForceRow], Field(min_length=3)]  #: both ``at`` and ``force_n`` rise.

    @model_validator(mode="after")
    def _rises(self) -> "ForceTable":
        for k, (one, other) in enumerate(pairwise(self.rows)):
            if other.at <= one.at or other.force_n <= one.force_n:
                raise ValueError(
                    f"row {k + 2} ({other.at:g}, {other.force_n:g} N) does not lie above row {k + 1} "
                    f"({one.at:g}, {one.force_n:g} N): a deeper press takes more force; sort the rows, and "
                    "press again what does not rise"
                )
        return self

    def at(self, measure: float) -> tuple[float, float]:
        """N and its standard deviation; nothing pressed is no force, and known.

        Args:
            measure: metres or cubic metres, by ``of``.

        Raises:
            OutOfDomain: more than the last row.
        """
        rows = [(0.0, 0.0, 0.0), *((row.at, row.force_n, row.sigma_n) for row in self.rows)]
        at, force, sigma = np.array(rows).T
        if not 0.0 <= measure <= at[-1]:
            scale, words = _UNITS[self.of]
            raise OutOfDomain(
                f"the press is {measure * scale:.4g} {words} and the table of forces ends at "
                f"{at[-1] * scale:.4g}; nothing is read beyond it: press less, or measure deeper presses"
            )
        # Cubics that pass every row and rise wherever the rows do (Fritsch and Butland, 1984).
        return float(PchipInterpolator(at, force)(measure)), float(np.interp(measure, at, sigma))

    def measure(self, depth: FloatArray, pitch: float) -> float:
        """What the table goes by, of one press ``(rows, columns)`` metres."""
        return float(depth.max() if self.of == "depth_m" else depth.sum() * pitch**2)


def read_force_table(path: Path) -> ForceTable:
    """A table of forces, ``docs/explanation/touch_force.md``; raises as ``read_model``."""
    return read_model(path, ForceTable, "table of forces", "docs/explanation/touch_force.md shows one")
