"""``touchstone object compare vision``: a camera's picture of an object beside that of its networks."""

from pathlib import Path
from typing import Annotated

import typer

from harness.commands import options
from harness.commands.object import vision_options
from harness.commands.output import print_result

DEFAULT_ANGLE = "40deg"


def compare(
    folder: options.ObjectFolder,
    out: Annotated[
        Path, typer.Option(help="Live, simulated and their difference, side by side.", metavar="FILE.png")
    ],
    live: Annotated[
        Path | None,
        typer.Option(help="What a camera saw; what --station's sees now, if left out.", metavar="IMAGE"),
    ] = None,
    background: Annotated[
        Path | None,
        typer.Option(
            help="The same camera's picture of the bench without the object; colours alone tell where the "
            "object is, if left out.",
            metavar="IMAGE",
        ),
    ] = None,
    camera: vision_options.Camera = None,
    look_at: vision_options.LookAt = None,
    up: vision_options.Up = None,
    field_of_view: Annotated[
        str | None,
        typer.Option(help=f"Across the picture's width; {DEFAULT_ANGLE} if left out.", metavar="A"),
    ] = None,
    light: vision_options.Light = None,
    station: Annotated[
        str | None,
        typer.Option(help="The bench whose scene camera it is; in place of --camera.", metavar="NAME"),
    ] = None,
    scene: Annotated[
        Path | None,
        typer.Option(
            help="Where the object stands and what lamps there are (with --station).", metavar="FILE"
        ),
    ] = None,
    seed: Annotated[int, typer.Option(help="Of a mocked bench.", min=0)] = 0,
    fit: Annotated[
        str, typer.Option(help="Of each channel: gain-offset, gain, or none.", metavar="WHAT")
    ] = "gain-offset",
    threads: vision_options.Threads = None,
    json: options.Json = False,
) -> int:
    """A camera's picture of an object beside the simulated one: where they differ, once exposed alike.

    Gain and offset of each channel (exposure and white balance) are fitted in linear light over pixels of
    the object that are neither black nor white, deaf to highlights; their standard errors are said.

    Try: touchstone object compare vision objects/mug --live mug.jpg --camera 0.25 -0.2 0.2 --out sheet.png
    """
    from harness import api
    from harness.basics.quantities import ANGLE

    options.require_files(("--out", out, ".png"))
    compared = api.compare_vision(
        folder,
        live=live,
        background=background,
        camera=camera,
        look_at=look_at,
        up=up,
        field_of_view=options.quantity("--field-of-view", field_of_view, ANGLE),
        light=light,
        station=station,
        scene=scene,
        seed=seed,
        fit=fit,
        threads=threads,
        out=out,
    )
    print_result(compared, json)
    return 0
