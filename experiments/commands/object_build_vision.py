"""``touchstone object build --only vision``: from a mesh with its colours to the look of an ObjectFile."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.table import Table

from harness.output import ANSWERS, emit, share_progress, warn

if TYPE_CHECKING:
    from harness.authoring.object_vision import BuiltVision
    from harness.objectfile.vision_entry import VisionEntry


def build_vision_part(
    mesh: str,
    material: str,
    profile: str,
    units: str | None,
    wall: float | None,
    licence: str,
    seed: int,
    out: Path,
    threads: int | None,
    json: bool,
) -> int:
    """Build, measure and say; the options are those of ``object_build.build``, lengths in metres."""
    from harness.authoring.object_source import PartRequest
    from harness.authoring.object_vision import build_vision
    from harness.materials import material as named

    wanted = PartRequest(mesh, named(material), profile, units, wall, licence, seed)
    with share_progress() as report:
        built = build_vision(wanted, out, report, threads)
    for sentence in built.said:
        warn(sentence)
    if json:
        emit(as_json(built))
    else:
        print_built(built)
    return 0


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
