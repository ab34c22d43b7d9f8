"""Curves on disk: one JSON file a program and machine, under the user's cache directory."""

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from harness.cost import Curve, Point, Sample
from harness.cost_provenance import machine, machine_key
from harness.errors import DataRefused, TouchstoneError
from harness.recording import write_text_whole
from harness.store import default_folder

SCHEMA = 1


def curve_path(program: str, description: Mapping[str, str] | None = None) -> Path:
    """Where the curve of a program on a machine is kept; on this one where none is described."""
    key = machine_key(machine() if description is None else description)
    return default_folder() / "cost" / f"{program}-{key}.json"


def save(curve: Curve, path: Path) -> None:
    """Write a curve whole or not at all, making its folder."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text_whole(path, json.dumps(to_json(curve), indent=1, allow_nan=False) + "\n")


def load(path: Path) -> Curve:
    """Read a curve.

    Raises:
        DataRefused: the file is not one, or holds a number that cannot be.
        FileNotFoundError: there is none.
    """
    text = path.read_text(encoding="utf-8")
    try:
        return from_json(json.loads(text))
    except (ValueError, KeyError, TypeError, AttributeError, TouchstoneError) as error:
        raise DataRefused(
            f"{path} is not a cost curve of schema {SCHEMA} ({error}); delete it and measure again"
        ) from error


def to_json(curve: Curve) -> dict[str, Any]:
    """As JSON values; keys carry their unit."""
    return {
        "schema": SCHEMA,
        "program": curve.program,
        "title": curve.title,
        "made": curve.made,
        "machine": dict(curve.machine),
        "code": dict(curve.code),
        "notes": list(curve.notes),
        "points": [_point_json(point) for point in curve.points],
    }


def from_json(tree: Mapping[str, Any]) -> Curve:
    """The curve that ``to_json`` gave."""
    if tree["schema"] != SCHEMA:
        raise ValueError(f"its schema is {tree['schema']!r}")
    return Curve(
        program=str(tree["program"]),
        points=tuple(_point(point) for point in tree["points"]),
        machine={str(k): str(v) for k, v in tree["machine"].items()},
        code={str(k): str(v) for k, v in tree["code"].items()},
        made=str(tree["made"]),
        title=str(tree["title"]),
        notes=tuple(str(note) for note in tree["notes"]),
    )


_KEYS = {
    "run": "run",
    "object": "object",
    "error": "error_m",
    "radius": "radius90_m",
    "shared": "shared_cpu_s",
    "cpu": "cpu_s",
    "wall": "wall_s",
}


def sample_json(sample: Sample) -> dict[str, Any]:
    """One run at one setting as JSON values."""
    return {_KEYS[name]: value for name, value in asdict(sample).items()}


def sample_from(tree: Mapping[str, Any]) -> Sample:
    """The sample that ``sample_json`` gave."""
    if set(tree) != set(_KEYS.values()):
        raise ValueError(f"a sample has the keys {sorted(tree)}, not {sorted(_KEYS.values())}")
    return Sample(**{name: tree[key] for name, key in _KEYS.items()})


def _point_json(point: Point) -> dict[str, Any]:
    return {
        "name": point.name,
        "levels": dict(point.levels),
        "condition": dict(point.condition),
        "samples": [sample_json(sample) for sample in point.samples],
    }


def _point(tree: Mapping[str, Any]) -> Point:
    samples = tuple(sample_from(sample) for sample in tree["samples"])
    return Point(str(tree["name"]), tree["levels"], tree["condition"], samples)
