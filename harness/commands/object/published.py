"""Commands about objects whose networks were published by others: import, and ObjectFolder's query files."""

from pathlib import Path
from typing import Annotated

import typer

from harness.commands import options
from harness.commands.output import print_result

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
    from harness.tasks.published import ImportedObject

    with hold_folder(out):
        of = read(file, out, name, LICENCE if licence is None else licence, audio_bounds, touch_bounds)
    print_result(ImportedObject.of(of), json)
    return 0


def render_queries(
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
    size: Annotated[int, typer.Option(help="Pixels a side of pictures.", min=1, max=1024)] = 256,
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
    from harness import api
    from harness.basics.quantities import LENGTH
    from harness.objectfile.published.answers import QuerySettings, answer_queries, read_queries
    from harness.tasks.published import RenderedQueries

    unit = options.positive("--metres-per-unit", metres_per_unit, LENGTH)
    settings = QuerySettings(size, seconds, rate, objectfolder_compat, calibration, unit)
    files = {
        "--audio-vertices": audio_vertices,
        "--audio-forces": audio_forces,
        "--touch-vertices": touch_vertices,
        "--touch-gelinfo": touch_gelinfo,
        "--vision": vision,
    }
    of = api.load_object(folder)
    answered = answer_queries(of, read_queries(of, files, settings), settings, out)
    rendered = RenderedQueries.of(of.folder, of.description.name, objectfolder_compat, answered)
    print_result(rendered, json)
    return 0
