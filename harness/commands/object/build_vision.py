"""``touchstone object build --only vision``: from a mesh with its colours to the look of an ObjectFile."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.table import Table

from harness.commands.object.build_answer import build_and_say
from harness.commands.output import ANSWERS

if TYPE_CHECKING:
    from harness.authoring.object_source import PartRequest
    from harness.authoring.vision.object_vision import BuiltVision
    from harness.objectfile.vision_entry import VisionEntry


def build_vision_part(
    wanted: "PartRequest",
    out: Path,
    threads: int | None,
    json: bool,
    finish: bool = False,
) -> int:
    """Build, measure and say."""
    from harness.authoring.vision.object_vision import build_vision

    return build_and_say(
        lambda report: build_vision(wanted, out, report, threads, finish),
        *(as_json, print_built, json),
    )


def as_json(built: "BuiltVision") -> dict[str, Any]:
    """As scripts read it; an error without a number, as the decibels of equal pictures, is null."""
    entry = _entry(built)
    return {
        "schema": 1,
        "folder": str(built.object.folder),
        "level": entry.level,
        "networks": entry.grid.networks,
        "cell_m": entry.grid.cell_m,
        "width": entry.size.width,
        "settings": dict(built.vision.settings),
        "errors": {
            name: value if math.isfinite(value) else None for name, value in built.vision.errors.items()
        },
        "bytes": sum(file.bytes for file in entry.files),
        "seconds": dict(built.seconds),
        "seconds_in_all": sum(built.seconds.values()),
    }


def print_built(built: "BuiltVision") -> None:
    """For people: a table of what was measured on pictures never trained on, and of seconds."""
    entry = _entry(built)
    size = sum(file.bytes for file in entry.files) / 1e6
    networks = f"{entry.grid.networks} networks {entry.size.width} wide, {entry.level}"
    drawn = Table(title=f"{built.object.folder}: {networks}, {size:.1f} MB")
    drawn.add_column("on pictures never trained on", no_wrap=True)
    drawn.add_column("measured", justify="right", no_wrap=True)
    for name, value in built.vision.errors.items():
        drawn.add_row(name.replace("_", " "), f"{value:.4g}")
    drawn.add_section()
    for stage, seconds in built.seconds.items():
        drawn.add_row(f"seconds: {stage}", f"{seconds:.1f}")
    drawn.add_row("seconds in all", f"{sum(built.seconds.values()):.1f}")
    ANSWERS.print(drawn)


def _entry(built: "BuiltVision") -> "VisionEntry":
    entry = built.object.description.vision
    assert entry is not None
    return entry
