"""``touchstone object render vision``: a picture of an object by its networks."""

import re
from pathlib import Path
from typing import Annotated

import typer

from harness.commands import options
from harness.commands.object import vision_options
from harness.commands.output import print_result


def render(
    folder: options.ObjectFolder,
    out: Annotated[Path, typer.Option(help="The picture, before white, 8 bits sRGB.", metavar="FILE.png")],
    camera: vision_options.Camera = None,
    look_at: vision_options.LookAt = None,
    up: vision_options.Up = None,
    field_of_view: Annotated[str, typer.Option(help="Across the picture's width.", metavar="A")] = "40deg",
    light: vision_options.Light = None,
    size: Annotated[str, typer.Option(help="Pixels: a side, or columns x rows.", metavar="WxH")] = "256",
    rays: Annotated[
        int,
        typer.Option(
            help="Along a pixel: 2 are four, and see the edges of prints and shadows within it.", min=1, max=8
        ),
    ] = 1,
    turntable: Annotated[
        int | None,
        typer.Option(help="So many pictures of the object turned about its z, on one sheet.", metavar="N"),
    ] = None,
    depth_out: Annotated[
        Path | None, typer.Option(help="Metres along the camera's axis; inf beside it.", metavar="FILE.npy")
    ] = None,
    alpha_out: Annotated[
        Path | None, typer.Option(help="Share of each pixel that is covered.", metavar="FILE.npy")
    ] = None,
    threads: vision_options.Threads = None,
    json: options.Json = False,
) -> int:
    """A picture of an object from any side in any light, by the networks of its ObjectFile.

    Lengths are metres in the object's frame. A camera within the object is refused, and so is a light
    without a direction. With --turntable the object turns before camera and lamp.

    Try: touchstone object render vision objects/mug --camera 0.25 -0.2 0.2 --light 1 -1 1 --out mug.png
    """
    from harness import api
    from harness.basics.quantities import ANGLE

    options.require_files(
        ("--out", out, ".png"), ("--depth-out", depth_out, ".npy"), ("--alpha-out", alpha_out, ".npy")
    )
    rendered = api.render_vision(
        folder,
        camera=camera,
        look_at=look_at,
        up=up,
        field_of_view=options.quantity("--field-of-view", field_of_view, ANGLE),
        light=light,
        size=_pixels(size),
        rays=rays,
        turntable=turntable,
        threads=threads,
        out=out,
        depth_out=depth_out,
        alpha_out=alpha_out,
    )
    print_result(rendered, json)
    return 0


def _pixels(text: str) -> tuple[int, int]:
    """Return columns and rows."""
    from harness.basics.errors import WrongUse

    said = re.fullmatch(r"(\d{1,6})(?:[xX](\d{1,6}))?", text.strip())
    if said is None:
        raise WrongUse(
            f"--size {text} is no number of pixels; say a side as 256, or columns x rows as 320x240"
        )
    return int(said[1]), int(said[2] or said[1])
