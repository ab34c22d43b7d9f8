"""``touchstone object build --only touch``: from a mesh to the touch of an ObjectFile."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.table import Table

from harness.commands.object.build_answer import build_and_say
from harness.commands.output import ANSWERS

if TYPE_CHECKING:
    from harness.authoring.object_source import PartRequest
    from harness.authoring.touch.object_touch import BuiltTouch

_KINDS = {"trained_places": "trained places", "unseen_places": "unseen places", "any_press": "any press"}
_ROWS = {"level": "codes", "nearest_trained": "nearest trained place", "background": "untouched gel"}


def build_touch_part(wanted: "PartRequest", make: str | None, out: Path, threads: int, json: bool) -> int:
    """Build, measure and say; ``make`` is a sensor's name or the path of its file, None for the usual one."""
    from harness.authoring.touch.object_touch import TouchRequest, build_touch
    from harness.bench.sensor import DEFAULT_MAKE, described_sensor

    asked = TouchRequest(**vars(wanted), sensor=described_sensor(make or DEFAULT_MAKE).sensor)
    return build_and_say(lambda report: build_touch(asked, out, report, threads), _as_json, _print, json)


def _as_json(built: "BuiltTouch") -> dict[str, Any]:
    touch = built.touch
    errors = {kind: {name: dict(row) for name, row in rows.items()} for kind, rows in touch.errors.items()}
    return {
        "schema": 1,
        "folder": str(built.object.folder),
        "nodes": len(touch.codes.nodes),
        "settings": dict(touch.settings),
        "errors": errors,
        "measured": dict(touch.codes.measured),
        "bytes": sum(entry.bytes for entry in _entry(built).files),
        "seconds": dict(built.seconds),
    }


def _entry(built: "BuiltTouch") -> Any:
    entry = built.object.description.touch
    assert entry is not None
    return entry


def _print(built: "BuiltTouch") -> None:
    touch = built.touch
    size = sum(entry.bytes for entry in _entry(built).files) / 1e6
    drawn = Table(title=f"{built.object.folder}: {len(touch.codes.nodes)} coded places, {size:.1f} MB")
    for heading in ("presses at", "maps from", "PSNR dB, median", "10th percentile", "possible of asked"):
        drawn.add_column(heading, no_wrap=True)
    for kind, rows in touch.errors.items():
        counts = rows["presses"]
        for name, said in _ROWS.items():
            row = rows[name]
            cells = f"{row['psnr_db_median']:.1f}", f"{row['psnr_db_p10']:.1f}"
            drawn.add_row(_KINDS[kind], said, *cells, f"{counts['possible']:.0f} of {counts['asked']:.0f}")
    ANSWERS.print(drawn)
    said = ", ".join(f"{stage} {seconds:.1f} s" for stage, seconds in built.seconds.items())
    ANSWERS.print(said, markup=False)
