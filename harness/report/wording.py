"""Format numbers with their units for the operator."""

from collections.abc import Callable, Iterator, Mapping

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.files.json_file import JsonObject
from harness.basics.result import split_unit
from harness.experiment.report_content import COUNT, AnswerValue

NONE = "\N{EN DASH}"
"""Stands where there is no number."""


def millimetres(metres: float | None, digits: int = 2) -> str:
    """Format a length with its unit, or a dash."""
    return NONE if metres is None else f"{metres * 1e3:.{digits}f} mm"


def duration(seconds: float | None) -> str:
    """Format a duration with a suitable unit, or a dash."""
    if seconds is None:
        return NONE
    if seconds < 1e-3:
        return f"{seconds * 1e6:.0f} µs"
    return f"{seconds * 1e3:.3g} ms" if seconds < 1.0 else f"{seconds:.2f} s"


def rate(hertz: float | None) -> str:
    """Format a frequency with its unit, or a dash."""
    if hertz is None:
        return NONE
    return f"{hertz:.4g} Hz" if hertz < 1e4 else f"{hertz / 1e3:.5g} kHz"


def place(position: FloatArray) -> str:
    """Format a point in millimetres, without the unit."""
    x, y, z = position * 1e3
    return f"({x:.1f}, {y:.1f}, {z:.1f})"


_TYPESET = {"deg": "\N{DEGREE SIGN}", "mm2": "mm²", "cm3": "cm³"}
"""Units of text that a page shows with other characters."""

_LONGEST = 4
"""Numbers of a list that are all shown; of a longer one its ends are."""

_HASH = 12
"""Letters of a hash that are shown."""


def format_key(key: str, value: object) -> tuple[str, str, str]:
    """Format a key of JSON and its value as name, value and unit.

    Args:
        key: key that ends with its unit, e.g. ``"gel_centre_m"``; dots separate the levels of a tree.
        value: a number, a text, or a list of either.
    """
    label, factor, unit = split_unit(key)
    name, unit = label.replace(".", ": "), _TYPESET.get(unit, unit)
    if isinstance(value, list) and not all(isinstance(item, int | float) for item in value):
        return name, ", ".join(format_key(key, item)[1] for item in value), unit
    if isinstance(value, list) and len(value) > _LONGEST:
        return name, f"{len(value)} values, from {factor * value[0]:.4g} to {factor * value[-1]:.4g}", unit
    if isinstance(value, list) and value:
        scaled = factor * np.array(value, np.float64)
        # Four digits of the greatest; adding zero removes the sign of a zero.
        digits = 3 - int(np.floor(np.log10(max(float(np.abs(scaled).max()), 1e-12))))
        return name, f"({', '.join(f'{number:g}' for number in np.round(scaled, digits) + 0.0)})", unit
    if isinstance(value, bool):
        return name, "yes" if value else "no", unit
    if isinstance(value, float):
        return name, f"{factor * value + 0.0:.4g}", unit
    return name, str(value)[:_HASH] if key.endswith("sha256") else str(value), unit


def show_value(name: str, key: str, value: object, uncertainty: str = "") -> AnswerValue:
    """Create a row of the answer's table from a key of the result and its value."""
    _, number, unit = format_key(key, value)
    return AnswerValue(name, number, unit or COUNT, uncertainty)


def show_estimates(
    estimates: Mapping[str, JsonObject],
    senses: Mapping[str, str],
    quantities: Mapping[str, str],
    uncertainty: Callable[[JsonObject], str],
) -> Iterator[AnswerValue]:
    """Yield the rows of each sense's estimate in the answer's table.

    Args:
        estimates: estimates of a result by sense; values that are null have no row.
        senses: names of the senses, in the order of the rows.
        quantities: names of the quantities by their key in an estimate.
        uncertainty: function that returns the uncertainty of an estimate's first quantity.
    """
    for sense, words in senses.items():
        estimate, first = estimates.get(sense, {}), next(iter(quantities))
        for key, name in quantities.items():
            if estimate.get(key) is not None:
                within = uncertainty(estimate) if key == first else ""
                yield show_value(f"{name}, {words}", key, estimate[key], within)
