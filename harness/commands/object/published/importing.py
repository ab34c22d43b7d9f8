"""``touchstone object import``: a published ObjectFile as a folder of ours."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from harness.commands import options
from harness.commands.object.published.info import published_lines
from harness.commands.output import ANSWERS, emit

if TYPE_CHECKING:
    from harness.objectfile.published.folder import PublishedObject

Two = tuple[float, float]


def import_published(
    file: Annotated[Path, typer.Argument(help="A published ObjectFile, 1.0 or 2.0.", metavar="FILE.pth")],
    out: Annotated[Path, typer.Option(help="The folder that is made.", metavar="FOLDER")],
    name: Annotated[str | None, typer.Option(help="Of the object; the file's if left out.")] = None,
    licence: Annotated[
        str | None, typer.Option(help="Of the file; ObjectFolder's own, CC BY 4.0, if left out.")
    ] = None,
    audio_bounds: Annotated[
        Two | None,
        typer.Option(
            help="Of 1.0: least and greatest coordinate, in voxels, that its sound was normalised by.",
            metavar="LOW HIGH",
        ),
    ] = None,
    touch_bounds: Annotated[
        Two | None,
        typer.Option(
            help="Of 1.0: least and greatest coordinate, in metres, that its touch was normalised by.",
            metavar="LOW HIGH",
        ),
    ] = None,
    json: options.Json = False,
) -> int:
    """Read a published ObjectFile (ObjectFolder 1.0 or 2.0) into a folder of ONNX networks and object.json.

    Nothing in the file is run: tensors and numbers are read, anything else is refused. It needs torch and
    onnxscript, which are in the extra `author`; the folder needs neither. What the file does not hold is
    listed, and not guessed: bounds of 1.0 are given with --audio-bounds and --touch-bounds, or that sense
    refuses to be queried.

    Try: touchstone object import ObjectFile.pth --out objects/published_mug
    """
    options.require_folders(("--out", out))
    from harness.authoring.published.imported import LICENCE
    from harness.authoring.published.imported import import_published as read
    from harness.basics.files.lock_file import hold_folder

    with hold_folder(out):
        of = read(file, out, name, LICENCE if licence is None else licence, audio_bounds, touch_bounds)
    if json:
        emit(as_json(of))
    else:
        for line in published_lines(of.description):
            ANSWERS.print(line, markup=False)
        ANSWERS.print(str(of.folder), markup=False)
    return 0


def as_json(of: "PublishedObject") -> dict[str, object]:
    """As scripts read it: what the folder holds, without the networks' self-tests."""
    description = of.description
    return {
        "schema": 1,
        "folder": str(of.folder),
        "object": description.name,
        "format": description.format,
        "sha256": description.provenance.sources[0].sha256,
        "licence": description.provenance.licence,
        "networks": {
            sense: {"file": entry.file, "bytes": entry.bytes} for sense, entry in description.networks.items()
        },
        "missing": list(description.missing),
        "dropped": dict(description.dropped),
    }
