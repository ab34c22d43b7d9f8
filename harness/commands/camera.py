"""``touchstone camera``: what a camera of the station sees now, as a picture."""

from pathlib import Path
from typing import Annotated

import typer

from harness.commands import options
from harness.commands.output import CONSOLE, print_result


def camera(
    name: Annotated[str, typer.Argument(help="gel, or scene for the camera that looks on.", metavar="NAME")],
    out: Annotated[Path, typer.Option(help="The picture, a PNG.", metavar="FILE")] = Path("live.png"),
    station: options.Station = "mock",
    object_: options.Object = "builtin:mug",
    material: options.Material = None,
    units: options.Units = None,
    json: options.Json = False,
) -> int:
    """Write what a camera of the station sees now; the arm and all else stay closed.

    To aim a camera, to clean a gel, to see that a cable carries pictures. A mocked bench shows --object, or
    its gel at rest.

    Try: touchstone camera gel --station mock --out live.png
    """
    from harness import api
    from harness.bench.scene import scene_from_options

    options.require_files(("--out", out, ".png"))
    shown = scene_from_options(object_ or "builtin:mug", material, units)
    with CONSOLE.status(f"opening the {name} camera of {station}"):
        picture = api.take_picture(name, out, station, shown)
    print_result(picture, json)
    return 0
