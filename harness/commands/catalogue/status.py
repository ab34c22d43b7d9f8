"""``touchstone catalogue status`` and ``page``: what a build has made so far."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from harness.commands import options
from harness.commands.output import ANSWERS, emit

if TYPE_CHECKING:
    from harness.authoring.catalogue.summary import ObjectSummary

BuiltFolder = Annotated[Path, typer.Argument(help="The --out folder of a build.", metavar="FOLDER")]


def status(folder: BuiltFolder, json: options.Json = False) -> int:
    """Say of every object of a build whether it is built, how well, and if not why.

    A build may be running meanwhile. Exit code 0 where all objects are built, else 1.

    Try: touchstone catalogue status built
    """
    from harness.authoring.catalogue.layout import BuildFolder, read_settings
    from harness.authoring.catalogue.summary import summaries

    of = BuildFolder(folder)
    excluded = read_settings(of).excluded
    found = summaries(of)
    if json:
        emit({
            "schema": 1,
            "folder": str(folder),
            "counts": dict(Counter(each.outcome for each in found)),
            "objects": [_as_json(each) for each in found],
            "excluded": [{"name": row.name, "reason": row.reason} for row in excluded],
        })  # fmt: skip
    else:
        _print(found, len(excluded))
    return 0 if all(each.outcome == "built" for each in found) else 1


def page(
    folder: BuiltFolder,
    out: Annotated[
        Path | None, typer.Option(help="The page; FOLDER/catalogue.html if left out.", metavar="FILE.html")
    ] = None,
    json: options.Json = False,
) -> int:
    """Write one page of all objects of a build: a picture, modes and quality of each, and what failed.

    The page refers to nothing outside itself.

    Try: touchstone catalogue page built
    """
    from harness.authoring.catalogue.layout import BuildFolder, read_settings
    from harness.authoring.catalogue.summary import summaries
    from harness.report.catalogue_page import PAGE, write_catalogue_page

    options.require_files(("--out", out, ".html"))
    of = BuildFolder(folder)
    settings = read_settings(of)
    excluded = [(row.name, row.reason) for row in settings.excluded]
    path = write_catalogue_page(summaries(of), excluded, settings.catalogue, out or folder / PAGE)
    if json:
        emit({"schema": 1, "page": str(path), "bytes": path.stat().st_size})
    else:
        ANSWERS.print(str(path), markup=False)
    return 0


def _as_json(found: "ObjectSummary") -> dict[str, Any]:
    audio = None if found.object is None else found.object.description.audio
    return {
        "name": found.name,
        "outcome": found.outcome,
        "reason": found.reason,
        "attempts": 0 if found.record is None else found.record.attempts,
        "seconds": None if found.record is None else found.record.seconds,
        "modes": None if audio is None else len(audio.frequencies_hz),
        "quality": dict(found.quality),
    }


def _print(found: "Sequence[ObjectSummary]", excluded: int) -> None:
    from harness.authoring.catalogue.summary import QUALITY

    drawn = Table(title="objects")
    for heading in ("object", "outcome", "seconds", *(heading for _, heading, _ in QUALITY.values())):
        drawn.add_column(heading, no_wrap=True)
    for each in found:
        seconds = "" if each.record is None else f"{each.record.seconds:.1f}"
        numbers = [f"{each.quality[key]:.3g}" if key in each.quality else "" for key in QUALITY]
        drawn.add_row(each.name, each.outcome, seconds, *numbers)
    ANSWERS.print(drawn)
    for each in found:
        if each.reason and each.outcome != "waiting":
            ANSWERS.print(f"{each.name}: {each.outcome}: {each.reason}", markup=False)
    counts = ", ".join(
        f"{count} {name}" for name, count in Counter(each.outcome for each in found).most_common()
    )
    ANSWERS.print(f"{len(found)} objects: {counts}; {excluded} rows excluded", markup=False)
