"""``touchstone object render touch``: what a gel's camera sees of a press onto an object."""

from pathlib import Path
from typing import Annotated

import typer

from harness.commands import options, places
from harness.commands import press_options as presses
from harness.commands.output import print_result


def render(
    folder: options.ObjectFolder,
    out: Annotated[Path, typer.Option(help="The picture, 8 bits RGB.", metavar="FILE.png")],
    contact: presses.Contact = None,
    vertex: places.VertexOption = None,
    depth: presses.Depth = None,
    tilt: presses.Tilt = None,
    azimuth: presses.Azimuth = None,
    yaw: presses.Yaw = None,
    level: Annotated[
        str,
        typer.Option(help="Where the map comes from: codes, or reference (the mesh's rasteriser)."),
    ] = "codes",
    sensor: presses.Sensor = None,
    calibration: presses.Calibration = None,
    picture: Annotated[
        Path | None,
        typer.Option(
            help="Map and picture, beside the rasteriser's, and the differences.", metavar="FILE.png"
        ),
    ] = None,
    height_out: Annotated[
        Path | None,
        typer.Option(
            help="The gel's surface, metres, as `sim touch --heights-of gel` takes it.", metavar="FILE.npy"
        ),
    ] = None,
    force: presses.Force = False,
    gel_modulus: presses.Modulus = None,
    gel_modulus_error: presses.ModulusError = None,
    gel_poisson: presses.Poisson = None,
    force_table: presses.Table = None,
    json: options.Json = False,
) -> int:
    """What the camera behind a gel sees of a press onto an object, by its ObjectFile.

    The surface of the gel comes from the object's codes; beside it stands what the rasteriser makes of its
    mesh, and how far the one is from the other. A depth, tilt or place that the codes were not made for is
    refused.

    Try: touchstone object render touch objects/mug --contact -0.04 0 0.05 --tilt 5deg --out touch.png
    """
    from harness import api

    options.require_files(
        ("--out", out, ".png"), ("--picture", picture, ".png"), ("--height-out", height_out, ".npy")
    )
    stiffness = gel_modulus, gel_modulus_error, gel_poisson
    rendered = api.render_touch(
        folder,
        vertex=vertex,
        **presses.read_pose(contact, depth, tilt, azimuth, yaw),
        level=level,
        sensor=sensor,
        calibration=calibration,
        gel=presses.read_stiffness(force, (), *stiffness, force_table=force_table),
        force_table=force_table,
        out=out,
        height_out=height_out,
        picture=picture,
    )
    print_result(rendered, json)
    return 0
