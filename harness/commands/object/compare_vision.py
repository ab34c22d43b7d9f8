"""``touchstone object compare vision``: a camera's picture of an object beside that of its networks."""

import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from harness.commands import options
from harness.commands.object import vision_options
from harness.commands.object.compare_vision_answer import (
    Compared,
    ComparedPhoto,
    as_json,
    draw,
    notes,
    print_answer,
)
from harness.commands.object.vision_options import Three
from harness.commands.output import emit, warn

if TYPE_CHECKING:
    from harness.basics.arrays import ByteArray
    from harness.bench.scene_camera import Lamp
    from harness.objectfile.file import ObjectFile
    from harness.objectfile.vision.render import ObjectVision
    from harness.picture.pinhole import Pinhole

DEFAULT_ANGLE = "40deg"


@dataclass(frozen=True, eq=False)
class _Wanted:
    """What the command was told, where pictures come from and how they are taken."""

    live: Path | None
    background: Path | None
    station: str | None
    scene: Path | None
    seed: int
    eye: Three | None
    look_at: Three | None
    up: Three | None
    angle: str | None
    light: Three | None


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
    import numpy as np

    from harness.picture.exposure_fit import exposure_kind
    from harness.picture.image_file import read_image
    from harness.picture.linear_image import LinearImage
    from harness.picture.live_picture import compare_live

    options.require_files(("--out", out, ".png"))
    kind = exposure_kind(fit)
    wanted = _Wanted(live, background, station, scene, seed, camera, look_at, up, field_of_view, light)
    _require_one_camera(wanted)
    begun = time.perf_counter()
    of, vision = vision_options.opened(folder, threads)
    seconds = {"load": time.perf_counter() - begun}
    begun = time.perf_counter()
    seen = _of_file(wanted, vision) if station is None else _of_station(wanted, station, of)
    behind = None if background is None else read_image(background)
    seconds["live"] = time.perf_counter() - begun
    begun = time.perf_counter()
    # Light of all lamps, each in its colour.
    pictures = [vision.picture(seen.camera, lamp.light).image for lamp in seen.lamps]
    parts = [picture.colour * lamp.colour for picture, lamp in zip(pictures, seen.lamps, strict=True)]
    image = LinearImage(np.sum(parts, axis=0), pictures[0].alpha, pictures[0].depth)
    seconds["render"] = time.perf_counter() - begun
    found = compare_live(seen.live, image, behind, kind)
    said = Compared(of, vision, seen, found, seconds)
    draw(said, out)
    for sentence in notes(said):
        warn(sentence)
    files = {"live": live, "background": background, "image": out}
    if json:
        emit(as_json(said, files))
    else:
        print_answer(said, files)
    return 0


def _require_one_camera(wanted: _Wanted) -> None:
    own = (wanted.eye, wanted.look_at, wanted.up, wanted.angle)
    if wanted.station is None:
        if wanted.scene is not None:
            _refuse("--scene says where the object stands on a bench; say which with --station NAME")
        if wanted.live is None or wanted.eye is None:
            _refuse(
                "say what a camera saw and from where: --live IMAGE with --camera X Y Z, or --station NAME "
                "with --scene FILE"
            )
    elif wanted.scene is None or any(given is not None for given in own):
        _refuse(
            "--station knows its camera and needs --scene FILE, where the object stands; --camera, "
            "--look-at, --up and --field-of-view are of a camera without a station"
        )


def _refuse(sentence: str) -> NoReturn:
    from harness.basics.errors import WrongUse

    raise WrongUse(sentence)


def _of_file(wanted: _Wanted, vision: "ObjectVision") -> ComparedPhoto:
    from harness.basics.quantities import ANGLE
    from harness.objectfile.vision.view import camera_for
    from harness.picture.image_file import read_image

    angle = options.quantity("--field-of-view", wanted.angle or DEFAULT_ANGLE, ANGLE)
    assert wanted.live is not None
    live = read_image(wanted.live)
    rows, columns = live.shape[:2]
    camera = camera_for(vision.surface, columns, rows, wanted.eye, wanted.look_at, wanted.up, angle)
    return _lit_by(wanted, live, camera, ())


def _of_station(wanted: _Wanted, station: str, of: "ObjectFile") -> ComparedPhoto:
    from harness.bench.scene import load_scene
    from harness.bench.scene_camera import scene_frame, scene_lamps, scene_pinhole
    from harness.bench.station_file import load_station, station_path
    from harness.effects.scene_object import known_object
    from harness.objectfile.same_object import require_same_shape
    from harness.picture.image_file import read_image
    from harness.sim.solid.walls import walled

    assert wanted.scene is not None
    bench, scene = load_station(station_path(station)), load_scene(wanted.scene)
    known = known_object(scene).mesh
    require_same_shape(of, walled(known, scene.object.wall), "the --scene of this object")
    camera, lamps = scene_pinhole(bench, scene, known), scene_lamps(scene, known)
    live = scene_frame(bench, scene, known, wanted.seed) if wanted.live is None else read_image(wanted.live)
    return _lit_by(wanted, live, camera, lamps)


def _lit_by(
    wanted: _Wanted, live: "ByteArray", camera: "Pinhole", known: "tuple[Lamp, ...]"
) -> ComparedPhoto:
    import numpy as np

    from harness.bench.scene_camera import Lamp
    from harness.objectfile.vision.view import light_for
    from harness.picture.pinhole import DirectionalLight

    if wanted.light is not None:
        told = Lamp(DirectionalLight(np.array(wanted.light)), np.ones(3))
        return ComparedPhoto(live, camera, (told,), False)
    return ComparedPhoto(live, camera, known or (Lamp(light_for(camera), np.ones(3)),), not known)
