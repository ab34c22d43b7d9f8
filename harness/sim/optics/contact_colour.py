"""What a contact does to the colour whatever its slope, read back from a calibration's own table.

A real gel is darker by a dozen grey levels where something touches it, even at the apex of a ball, where it
is as flat as untouched. The smooth model of ``harness.sim.optics.shading`` has no such term, so that a flat
gel changes no colour, and leans its slopes instead. The table holds both: per bin it is

    table = slopes(normal, position) + offset(position),

linear in both and decoupled by the terms of the position, so least squares over the bins that presses
reached parts them.
"""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import FloatArray, read_only
from harness.basics.errors import CalibrationRefused
from harness.sim.optics.lit_calibration import place_terms
from harness.sim.optics.shading import POSITION_TERMS, design, scaled_position
from harness.sim.optics.tactile_calibration import TABLE_TERMS, TactileCalibration

FLATTEST = np.radians(5.0)
"""Slope from which on the table holds all of a contact's offset, which is let in over the first 4 degrees."""

_LEAST_BINS = 100
_RIDGE = 1e-9


@dataclass(frozen=True, eq=False)
class ContactColour:
    """A contact's colour in two parts.

    Attributes:
        slopes: ``(120, 3)`` coefficients of ``harness.sim.optics.shading``.
        offset: ``(rows, columns, 3)`` grey levels that a contact adds to what its slope gives.
        misfit: grey levels rms by which the table's bins differ from both together.
    """

    slopes: FloatArray
    offset: FloatArray
    misfit: float


def contact_colour(calibration: TactileCalibration) -> ContactColour:
    """Part the table of a calibration into slopes and offset.

    Raises:
        CalibrationRefused: presses reached too few bins to tell.
    """
    normal, bins = _reached(calibration)
    places = bins @ _between(calibration.rows, calibration.columns).T  # (n, 3, 6): channel, place term
    terms = np.hstack([_normal_terms(normal), np.ones((len(normal), 1))])
    gram = terms.T @ terms
    gram += _RIDGE * np.diag(np.diag(gram))
    flat = places.transpose(0, 2, 1).reshape(len(normal), -1)
    found = np.linalg.solve(gram, terms.T @ flat)
    misfit = float(np.sqrt(np.mean((terms @ found - flat)[:, :3] ** 2)))
    found = found.reshape(-1, POSITION_TERMS, 3)
    y, x = (axis.ravel().astype(np.float64) for axis in np.mgrid[: calibration.rows, : calibration.columns])
    offset = place_terms(scaled_position(x, y, calibration.rows, calibration.columns)) @ found[-1]
    return ContactColour(
        read_only(np.ascontiguousarray(found[:-1].reshape(-1, 3))),
        read_only(offset.reshape(calibration.rows, calibration.columns, 3)),
        misfit,
    )


def _reached(calibration: TactileCalibration) -> tuple[FloatArray, FloatArray]:
    """Normals ``(n, 2)`` of the bins that say something, and their entries ``(n, 3, 6)``."""
    step = 0.5 * np.pi / (calibration.bins - 1)
    row, column = np.nonzero(calibration.support[:, :-1])
    steep = (row + 0.5) * step
    inside = (steep > FLATTEST) & (np.sin(steep) <= calibration.header.slope_limit)
    row, column, steep = row[inside], column[inside], steep[inside]
    if len(row) < _LEAST_BINS:
        raise CalibrationRefused(
            f"presses reached {len(row)} bins of this calibration's table between "
            f"{np.degrees(FLATTEST):.0f} deg and its steepest slope; at least {_LEAST_BINS} are wanted: "
            "fit it again from more presses"
        )
    towards = -np.pi + (column + 0.5) * 4.0 * step
    # A height's gradient has the normal's image part pointing the other way.
    normal = -np.sin(steep)[:, None] * np.stack([np.cos(towards), np.sin(towards)], axis=1)
    return normal, calibration.table[row, column].astype(np.float64).transpose(0, 2, 1)


def _normal_terms(normal: FloatArray) -> FloatArray:
    """``(n, 20)``: the smooth model's terms at the image's centre, where of the position's only 1 is left."""
    terms = design(normal, np.zeros_like(normal))
    return np.ascontiguousarray(terms[:, ::POSITION_TERMS], dtype=np.float64)


def _between(rows: int, columns: int) -> FloatArray:
    """``(6, 6)`` from the table's coefficients, in pixels, to those of the scaled position."""
    x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(0, columns - 1, 3), np.linspace(0, rows - 1, 3)))
    raw = np.stack([x * x, y * y, x * y, x, y, np.ones_like(x)], axis=1)
    assert raw.shape[1] == TABLE_TERMS
    back = np.linalg.pinv(place_terms(scaled_position(x, y, rows, columns)))
    return np.asarray(back @ raw, dtype=np.float64)
