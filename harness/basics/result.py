"""Results of the API as JSON values and as text, both generated from the fields of a dataclass.

The names of the fields are the JSON keys, with the unit as a suffix (``edge_m``, ``frequencies_hz``). Text
gives every field with a name and a unit that people use: ``edge_m = 0.004`` is printed as ``edge 4 mm``.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from itertools import zip_longest
from pathlib import Path
from typing import Any, ClassVar, TypeAlias

import numpy as np

JsonValue: TypeAlias = bool | int | float | str | list["JsonValue"] | dict[str, "JsonValue"] | None

_UNITS = {
    "_m_per_s": (1.0, "m/s"),
    "_per_s": (1.0, "1/s"),
    "_share": (100.0, "%"),
    "_rad": (180.0 / math.pi, "deg"),
    "_hz": (1.0, "Hz"),
    "_kg": (1.0, "kg"),
    "_db": (1.0, "dB"),
    "_pa": (1.0, "Pa"),
    "_m2": (1e6, "mm2"),
    "_m3": (1e6, "cm3"),
    "_m": (1e3, "mm"),
    "_n": (1.0, "N"),
    "_ns": (1.0, "N s"),
    "_s": (1.0, "s"),
}
"""Factor and unit of the text by the suffix of a field; longer suffixes first."""

HIDDEN: Mapping[str, bool] = {"text": False, "json": False}
"""Metadata of a field that is for Python alone: arrays of pixels, objects to compute with."""

JSON_ONLY: Mapping[str, bool] = {"text": False}
"""Metadata of a field that text leaves out, as the summary has its content."""


@dataclass(frozen=True)
class Result:
    """A result of the API; subclasses are frozen dataclasses that declare its fields."""

    schema: ClassVar[int] = 1  #: of the JSON object; raised when a key changes its meaning.

    def summary(self) -> Sequence[str]:
        """Return the answer in words, a sentence each."""
        return ()

    def tables(self) -> Iterable["TextTable"]:
        """Return the tables of the text: records, and names mapped to mappings."""
        return text_tables(self)

    def as_json(self) -> dict[str, JsonValue]:
        """Return the fields as JSON values; a number that is not finite is None."""
        return {"schema": self.schema, **_object(self)}


TextTable: TypeAlias = tuple[str, list[str], list[list[str]]]
"""Title, headings and rows."""


def text_tables(result: Result) -> Iterator[TextTable]:
    """Yield the vectors as one table, then every field of records or of mappings by name."""
    shown = list(_shown(result))
    vectors = {name: value for name, value in shown if isinstance(value, np.ndarray) and value.ndim == 1}
    if vectors:
        columns = [[number_text(name, item) for item in value] for name, value in vectors.items()]
        headings = [" ".join(filter(None, heading(name))) for name in vectors]
        yield "", headings, [list(row) for row in zip_longest(*columns, fillvalue="")]
    for name, value in shown:
        if _is_table(value):
            leaves = list(_leaves(value, ()))
            keys = list(dict.fromkeys(key for _, leaf in leaves for key in leaf))
            rows = [
                [
                    " ".join(path).replace("_", " "),
                    *(_text("", leaf[key]) if key in leaf else "" for key in keys),
                ]
                for path, leaf in leaves
            ]
            yield heading(name)[0], ["", *(key.replace("_", " ") for key in keys)], rows
        elif _is_records(value) and value:
            printed = [item.name for item in fields(value[0]) if item.metadata.get("text", True)]
            # A column that no record fills is left out.
            keys = [key for key in printed if any(vars(each)[key] not in (None, "", ()) for each in value)]
            rows = [[_cell(key, vars(each)[key]) for key in keys] for each in value]
            yield heading(name)[0], [" ".join(filter(None, heading(key))) for key in keys], rows


def _is_records(value: object) -> bool:
    return isinstance(value, tuple | list) and all(is_dataclass(each) for each in value)


def _cell(name: str, value: Any) -> str:
    """Format a value under a heading that has the unit."""
    if value is None:
        return ""
    return number_text(name, value, 4) if isinstance(value, float) else _text(name, value)


def _is_table(value: object) -> bool:
    return isinstance(value, Mapping) and any(isinstance(item, Mapping) for item in value.values())


def _leaves(
    value: Mapping[str, Any], path: tuple[str, ...]
) -> Iterator[tuple[tuple[str, ...], Mapping[str, Any]]]:
    if not _is_table(value):
        yield path, value
        return
    for key, item in value.items():
        yield from _leaves(item, (*path, key))


def text_rows(result: Result) -> Iterator[tuple[str, str]]:
    """Yield label and value of every other field that text shows."""
    for name, value in _shown(result):
        listed = isinstance(value, np.ndarray) or _is_table(value) or _is_records(value)
        if value is not None and not listed:
            yield heading(name)[0], _text(name, value)


def _shown(result: Result) -> Iterator[tuple[str, Any]]:
    for item in fields(result):
        if item.name != "notes" and item.metadata.get("text", True):
            yield item.name, vars(result)[item.name]


def split_unit(name: str) -> tuple[str, float, str]:
    """Split the name of a field into its label, and the factor and the unit of its text.

    ``"edge_m"`` is ``("edge", 1e3, "mm")``.
    """
    suffix = next((suffix for suffix in _UNITS if name.endswith(suffix)), "")
    return name.removesuffix(suffix).replace("_", " "), *_UNITS.get(suffix, (1.0, ""))


def heading(name: str) -> tuple[str, str]:
    """Return the label and the unit of a field: ``"edge_m"`` is ``("edge", "mm")``."""
    label, _, unit = split_unit(name)
    return label, unit


def number_text(name: str, value: float, digits: int = 5) -> str:
    """Format a number of a field in the unit of its text, without the unit."""
    return f"{value * split_unit(name)[1]:.{digits}g}" if math.isfinite(value) else "none"


def _text(name: str, value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float | np.number):
        return " ".join(filter(None, (number_text(name, float(value), 4), heading(name)[1])))
    if isinstance(value, Mapping):
        # Times by stage have no suffix of their own.
        unit = "_s" if name.startswith("seconds") else ""
        return ", ".join(
            f"{' '.join(heading(key)[:1])} {_text(key + unit, item)}" for key, item in value.items()
        )
    if is_dataclass(value) and not isinstance(value, type):
        return _text(name, {item.name: vars(value)[item.name] for item in fields(value)})
    if isinstance(value, tuple | list):
        return ", ".join(_text(name, item) for item in value)
    return str(value)


def _object(value: Any) -> dict[str, JsonValue]:
    kept = (item.name for item in fields(value) if item.metadata.get("json", True))
    return {name: json_value(vars(value)[name]) for name in kept}


def json_value(value: object) -> JsonValue:
    """Convert a value of a result to JSON values.

    Raises:
        TypeError: there is no JSON for it.
    """
    if isinstance(value, np.ndarray | np.generic):
        return json_value(value.tolist())
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, Mapping):
        return {str(key): json_value(item) for key, item in value.items()}
    if isinstance(value, tuple | list):
        return [json_value(item) for item in value]
    if is_dataclass(value) and not isinstance(value, type):
        return _object(value)
    raise TypeError(f"no JSON for a {type(value).__name__}")
