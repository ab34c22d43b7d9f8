"""``touchstone object render queries``: ObjectFolder's own query files, answered by an object."""

from pathlib import Path
from typing import Annotated

import typer

from harness.commands import options
from harness.commands.object.published.answers import answer_built, answer_queries, as_json
from harness.commands.object.published.files import QueryFiles
from harness.commands.output import ANSWERS, emit, warn

_COMPAT_SIZE = 256


def render(
    folder: options.ObjectFolder,
    out: Annotated[Path, typer.Option(help="Made, with audio, touch and vision in it.", metavar="FOLDER")],
    vision: Annotated[
        Path | None,
        typer.Option(
            help="Camera and light of each picture, (n, 6), in the vision frame.", metavar="FILE.npy"
        ),
    ] = None,
    audio_vertices: Annotated[
        Path | None, typer.Option(help="Where it is struck, (n, 3), metres.", metavar="FILE.npy")
    ] = None,
    audio_forces: Annotated[
        Path | None, typer.Option(help="The force of each strike, (n, 3).", metavar="FILE.npy")
    ] = None,
    touch_vertices: Annotated[
        Path | None, typer.Option(help="Where it is pressed, (n, 3), metres.", metavar="FILE.npy")
    ] = None,
    touch_gelinfo: Annotated[
        Path | None,
        typer.Option(
            help="Tilt, azimuth (rad) and depth (m) of each press, (n, 3); of 2.0.", metavar="FILE.npy"
        ),
    ] = None,
    calibration: Annotated[
        Path | None,
        typer.Option(help="Of the gel's colours: the folder calibs of ObjectFolder 2.0.", metavar="FOLDER"),
    ] = None,
    size: Annotated[int, typer.Option(help="Pixels a side of pictures.", min=1, max=1024)] = _COMPAT_SIZE,
    seconds: Annotated[float, typer.Option(help="Length of sounds.", metavar="S")] = 3.0,
    rate: Annotated[float, typer.Option(help="Samples per second.", metavar="HZ")] = 44100.0,
    metres_per_unit: Annotated[
        str | None,
        typer.Option(help="Of the vision frame about the middle of a built object, as 10cm.", metavar="L"),
    ] = None,
    objectfolder_compat: Annotated[
        bool,
        typer.Option(
            "--objectfolder-compat",
            help="As the published programs: 2 s of ringing in 3 s, each sound by its own peak; cameras at "
            "2.5, rays through the corners of pixels; greys cut off below; of 1.0, bounds of the query.",
        ),
    ] = False,
    json: options.Json = False,
) -> int:
    """Answer ObjectFolder's own query files by an object, imported or built: sounds, touches and pictures.

    Files are named as the published programs name them: audio/1.wav, touch/1.png, vision/000.png. Without
    --objectfolder-compat sounds keep their loudness relative to one another and ring on, cameras may stand
    at any distance, and pictures are rounded. A query that the networks were not trained at is refused
    either way.

    Try: touchstone object render queries objects/published_mug --vision vision_demo.npy --out rendered
    """
    options.require_folders(("--out", out))
    from harness.basics.errors import WrongUse
    from harness.basics.quantities import LENGTH
    from harness.objectfile.file import ObjectFile
    from harness.objectfile.published.folder import PublishedObject, holds_published

    if not 0.0 < seconds <= 60.0:
        raise WrongUse(f"--seconds {seconds:g}: sounds are above 0 and at most 60 s long")
    if objectfolder_compat and (size, seconds, rate) != (_COMPAT_SIZE, 3.0, 44100.0):
        raise WrongUse(
            "--objectfolder-compat says size, length and rate itself; leave --size, --seconds and --rate out"
        )
    given = QueryFiles(
        vision, audio_vertices, audio_forces, touch_vertices, touch_gelinfo, calibration, size, seconds, rate,
        options.positive("--metres-per-unit", metres_per_unit, LENGTH), objectfolder_compat,
    )  # fmt: skip
    of: PublishedObject | ObjectFile
    if holds_published(folder):
        of = PublishedObject.open(folder)
        found = answer_queries(of, given, out)
    else:
        of = ObjectFile.open(folder)
        found = answer_built(of, given, out)
    for sentence in found.notes:
        warn(sentence)
    if json:
        emit(as_json(of, given, found))
        return 0
    for sense, paths in found.files.items():
        ANSWERS.print(
            f"{sense}: {len(paths)} files, {paths[0]} and so on; {found.seconds[sense]:.2f} s", markup=False
        )
    return 0
