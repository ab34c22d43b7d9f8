"""``touchstone object render vision``: a picture of an object by its networks."""

import re
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from harness.commands import options
from harness.commands.object import vision_options
from harness.commands.object.render_vision_answer import (
    RenderedLook,
    View,
    as_json,
    print_answer,
    sheet,
    write_arrays,
)
from harness.commands.object.vision_options import Three
from harness.commands.output import emit

if TYPE_CHECKING:
    from harness.objectfile.vision.render import ObjectVision

_MOST_SHEET = 2**24
"""Pixels of all pictures of a turntable."""

_FIRST = 256
"""Columns, at most, of the picture that nobody sees."""


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
    from harness.basics.quantities import ANGLE
    from harness.objectfile.vision.render import RenderSettings
    from harness.picture.image_file import write_png

    options.require_files(
        ("--out", out, ".png"), ("--depth-out", depth_out, ".npy"), ("--alpha-out", alpha_out, ".npy")
    )
    angle = options.quantity("--field-of-view", field_of_view, ANGLE)
    chosen, pixels = RenderSettings(rays=rays), _pixels(size, turntable)
    begun = time.perf_counter()
    of, vision = vision_options.opened(folder, threads)
    views = _views(vision, pixels, camera, look_at, up, light, angle, turntable)
    # The first picture, a small one, loads the compiled loops for all that follow.
    eye, lamp = views[0]
    width = min(eye.width, _FIRST)
    first = eye.resized(width, max(1, round(eye.height * width / eye.width)))
    vision.picture(first, lamp, chosen)
    loaded, begun = time.perf_counter() - begun, time.perf_counter()
    pictures = tuple(vision.picture(*view, chosen) for view in views)
    seconds = {"load": loaded, "render": time.perf_counter() - begun}
    found = RenderedLook(of, vision, views, pictures, seconds)
    write_png(out, sheet(found))
    if depth_out is not None:
        write_arrays(depth_out, [picture.image.depth for picture in found.pictures])
    if alpha_out is not None:
        write_arrays(alpha_out, [picture.image.alpha for picture in found.pictures])
    if json:
        emit(as_json(found, out, depth_out, alpha_out))
    else:
        print_answer(found, out, depth_out, alpha_out)
    return 0


def _pixels(text: str, turntable: int | None) -> tuple[int, int]:
    """Columns and rows."""
    from harness.basics.errors import WrongUse
    from harness.objectfile.vision.view import require_size

    said = re.fullmatch(r"(\d{1,6})(?:[xX](\d{1,6}))?", text.strip())
    if said is None:
        raise WrongUse(
            f"--size {text} is no number of pixels; say a side as 256, or columns x rows as 320x240"
        )
    width, height = int(said[1]), int(said[2] or said[1])
    require_size(width, height)
    if turntable is not None and not 1 <= turntable <= _MOST_SHEET // (width * height):
        raise WrongUse(
            f"--turntable {turntable} of {width} x {height} pixels each; say 1 to "
            f"{_MOST_SHEET // (width * height)} pictures of that size, or smaller ones"
        )
    return width, height


def _views(
    vision: "ObjectVision",
    pixels: tuple[int, int],
    eye: Three | None,
    target: Three | None,
    up: Three | None,
    light: Three | None,
    angle: float,
    turntable: int | None,
) -> tuple[View, ...]:
    import numpy as np

    from harness.objectfile.vision.view import camera_for, light_for, turned
    from harness.picture.pinhole import DirectionalLight

    mesh = vision.surface
    camera = camera_for(mesh, *pixels, eye, target, up, angle)
    lamp = light_for(camera) if light is None else DirectionalLight(np.array(light))
    if turntable is None:
        return ((camera, lamp),)
    axis = mesh.bounds.mean(axis=0) if target is None else np.array(target)
    return tuple(turned(camera, lamp, axis, -2.0 * np.pi * k / turntable) for k in range(turntable))
