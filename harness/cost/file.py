"""Curves on disk: one JSON file a program and machine, under the user's cache directory."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from harness.basics.errors import DataRefused, TouchstoneError
from harness.basics.store import default_folder, digest
from harness.basics.whole_file import write_text_whole
from harness.cost.curve import Curve, Point, Sample
from harness.cost.provenance import machine

SCHEMA = 3

_DIGITS = 5
"""Significant ones that are kept: no clock and no bench tells more."""


def curve_path(program: str, description: Mapping[str, str] | None = None) -> Path:
    """Where the curve of a program on a machine is kept; on this one where none is described."""
    key = digest(dict(machine() if description is None else description))[:12]
    return default_folder() / "cost" / f"{program}-{key}.json"


def save(curve: Curve, path: Path) -> None:
    """Write a curve whole or not at all, making its folder."""
    path.parent.mkdir(parents=True, exist_ok=True)
    tree = to_json(curve)
    points = ",\n".join(json.dumps(point, allow_nan=False) for point in tree.pop("points"))
    head = json.dumps(tree, allow_nan=False).removesuffix("}")
    write_text_whole(path, f'{head}, "points": [\n{points}\n]}}\n')


def load(path: Path) -> Curve:
    """Read a curve.

    Raises:
        DataRefused: the file is not one, or holds a number that cannot be.
        FileNotFoundError: there is none.
    """
    text = path.read_text(encoding="utf-8")
    try:
        return from_json(json.loads(text))
    except (
        ValueError,
        KeyError,
        TypeError,
        IndexError,
        AttributeError,
        RecursionError,
        TouchstoneError,
    ) as error:
        raise DataRefused(
            f"{path} is not a cost curve of schema {SCHEMA}; delete it and measure again"
        ) from error


def to_json(curve: Curve) -> dict[str, Any]:
    """As JSON values; keys carry their unit. Runs are named once; a point's samples are columns."""
    runs = dict.fromkeys((sample.run, sample.object) for point in curve.points for sample in point.samples)
    return {
        "schema": SCHEMA,
        "program": curve.program,
        "title": curve.title,
        "made": curve.made,
        "machine": dict(curve.machine),
        "code": dict(curve.code),
        "notes": list(curve.notes),
        "runs": [{"run": run, "object": of} for run, of in runs],
        "points": [_point_json(point, {run: k for k, run in enumerate(runs)}) for point in curve.points],
    }


def from_json(tree: Mapping[str, Any]) -> Curve:
    """The curve that ``to_json`` gave."""
    if tree["schema"] != SCHEMA:
        raise ValueError(f"its schema is {tree['schema']!r}")
    return Curve(
        program=str(tree["program"]),
        points=tuple(_point(point, tree["runs"]) for point in tree["points"]),
        machine={str(k): str(v) for k, v in tree["machine"].items()},
        code={str(k): str(v) for k, v in tree["code"].items()},
        made=str(tree["made"]),
        title=str(tree["title"]),
        notes=tuple(str(note) for note in tree["notes"]),
    )


def summary(point: Point, on_front: bool) -> dict[str, Any]:
    """A setting in numbers, as commands answer it."""
    unit = point.unit.key
    return {
        "levels": dict(point.levels),
        "front": on_front,
        f"error_{unit}": point.error.value,
        f"error_low_{unit}": point.error.low,
        f"error_high_{unit}": point.error.high,
        f"median_error_{unit}": point.median_error.value,
        f"mean_error_{unit}": float(point.errors.mean()),
        "seconds": point.seconds.value,
        "seconds_low": point.seconds.low,
        "seconds_high": point.seconds.high,
    }


_KEYS = {
    "run": "run",
    "object": "object",
    "error": "error_m",
    "radius": "radius90_m",
    "shared": "shared_cpu_s",
    "cpu": "cpu_s",
    "wall": "wall_s",
    "work": "work",
}


def sample_json(sample: Sample) -> dict[str, Any]:
    """One run at one setting as JSON values."""
    return {_KEYS[name]: value for name, value in asdict(sample).items()}


def sample_from(tree: Mapping[str, Any]) -> Sample:
    """The sample that ``sample_json`` gave."""
    if set(tree) != set(_KEYS.values()):
        raise ValueError(f"a sample has the keys {sorted(tree)}, not {sorted(_KEYS.values())}")
    return Sample(**{name: tree[key] for name, key in _KEYS.items()})


_COLUMNS = {name: key for name, key in _KEYS.items() if name not in ("run", "object")}


def _point_json(point: Point, numbers: Mapping[tuple[str, str], int]) -> dict[str, Any]:
    samples = [asdict(sample) for sample in point.samples]
    return {
        "name": point.name,
        "levels": dict(point.levels),
        "condition": dict(point.condition),
        "runs": [numbers[sample.run, sample.object] for sample in point.samples],
        **{
            key: [None if one[name] is None else float(f"{one[name]:.{_DIGITS}g}") for one in samples]
            for name, key in _COLUMNS.items()
        },
    }


def _point(tree: Mapping[str, Any], runs: Sequence[Mapping[str, Any]]) -> Point:
    if min(tree["runs"]) < 0:
        raise ValueError(f"run {min(tree['runs'])} of {len(runs)}")
    columns = zip(*(tree[key] for key in _COLUMNS.values()), strict=True)
    samples = tuple(
        Sample(
            run=str(runs[number]["run"]),
            object=str(runs[number]["object"]),
            **dict(zip(_COLUMNS, row, strict=True)),
        )
        for number, row in zip(tree["runs"], columns, strict=True)
    )
    return Point(str(tree["name"]), tree["levels"], tree["condition"], samples)
