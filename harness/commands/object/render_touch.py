"""``touchstone object render touch``: what a gel's camera sees of a press onto an object."""

import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from harness.commands import force_options as forces
from harness.commands import options, places
from harness.commands.object.render_touch_answer import RenderedPress, as_json, draw, notes, print_answer
from harness.commands.output import emit, warn

if TYPE_CHECKING:
    from harness.effects.touch_press import Press
    from harness.objectfile.file import ObjectFile
    from harness.objectfile.touch.touch import ObjectTouch, TouchLevel
    from harness.sim.gel.elastic import GelElastic
    from harness.sim.gel.force_table import ForceTable
    from harness.sim.gel.press_pose import ContactPlace
    from harness.sim.optics.pressed_gel import Gel


def render(
    folder: options.ObjectFolder,
    out: Annotated[Path, typer.Option(help="The picture, 8 bits RGB.", metavar="FILE.png")],
    contact: Annotated[
        places.Coordinates | None,
        typer.Option(
            help="Where it is pressed, in the object's frame: metres, or each with its unit.", metavar="X Y Z"
        ),
    ] = None,
    vertex: places.VertexOption = None,
    depth: Annotated[str, typer.Option(help="How deep the gel's centre is pressed on.", metavar="L")] = "1mm",
    tilt: Annotated[str, typer.Option(help="Between the gel's axis and the normal.", metavar="A")] = "0deg",
    azimuth: Annotated[
        str, typer.Option(help="Which way it is tilted, from the gel's x at no yaw.", metavar="A")
    ] = "0deg",
    yaw: Annotated[str, typer.Option(help="The sensor turned about its own axis.", metavar="A")] = "0deg",
    level: Annotated[
        str,
        typer.Option(
            help="Where the map comes from: codes, perceptron, or reference (the mesh's rasteriser)."
        ),
    ] = "codes",
    sensor: Annotated[
        str | None,
        typer.Option(
            help="The make that presses, by its name or the path of its own file: the one that the "
            "touch was built for.",
            metavar="NAME",
        ),
    ] = None,
    calibration: Annotated[
        str | None,
        typer.Option(
            help="Of the colours: a file, a shipped one's name, or a published folder; the sensor's own if "
            "left out.",
            metavar="FILE",
        ),
    ] = None,
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
    force: forces.Force = False,
    gel_modulus: forces.Modulus = None,
    gel_modulus_error: forces.ModulusError = None,
    gel_poisson: forces.Poisson = None,
    force_table: forces.Table = None,
    json: options.Json = False,
) -> int:
    """What the camera behind a gel sees of a press onto an object, by its ObjectFile.

    The surface of the gel comes from the object's codes or its perceptron; beside it stands what the
    rasteriser makes of its mesh, and how far the one is from the other. A depth, tilt or place that the
    networks were not made for is refused.

    Try: touchstone object render touch objects/mug --contact -0.04 0 0.05 --tilt 5deg --out touch.png
    """
    from harness.basics.quantities import ANGLE, LENGTH
    from harness.picture.image_file import write_png

    options.require_files(
        ("--out", out, ".png"), ("--picture", picture, ".png"), ("--height-out", height_out, ".npy")
    )
    deep = options.quantity("--depth", depth, LENGTH)
    tilted, towards, turned = (
        options.quantity(option, text, ANGLE)
        for option, text in (("--tilt", tilt), ("--azimuth", azimuth), ("--yaw", yaw))
    )
    own = {"--gel-poisson": gel_poisson, "--force-table": force_table}
    forces.require_force(force, (), gel_modulus, gel_modulus_error, **own)
    table, levels = forces.measured(force_table, [])
    gel = _gel(sensor, calibration, forces.stiffness(gel_modulus, gel_modulus_error, gel_poisson), table)
    pressing = _Pressing(gel, (deep, tilted, towards, turned), levels, force)
    rendered = _rendered(folder, _level(level), contact, vertex, pressing)
    write_png(out, rendered.press.image)
    if height_out is not None:
        _write_heights(height_out, rendered)
    if picture is not None:
        draw(rendered, picture)
    for sentence in notes(rendered):
        warn(sentence)
    if json:
        emit(as_json(rendered, out, picture, height_out))
    else:
        print_answer(rendered, out, picture)
    return 0


@dataclass(frozen=True, eq=False)
class _Pressing:
    """What presses.

    Attributes:
        gel: that is pressed.
        pose: depth in m; tilt, azimuth and yaw in rad.
        levels: of its force.
        force: whether that is computed.
    """

    gel: "Gel"
    pose: tuple[float, float, float, float]
    levels: list[str]
    force: bool


def _gel(
    sensor: str | None, calibration: str | None, elastic: "GelElastic", table: "ForceTable | None"
) -> "Gel":
    from harness.sim.optics.known_gel import known_gel

    return replace(known_gel(sensor, calibration, shadow=False), elastic=elastic, forces=table)


def _rendered(
    folder: Path,
    level: "TouchLevel",
    contact: places.Coordinates | None,
    vertex: int | None,
    by: _Pressing,
) -> RenderedPress:
    from harness.objectfile.file import ObjectFile
    from harness.objectfile.touch.level import require_gel
    from harness.objectfile.touch.touch import ReferenceMaps, open_touch
    from harness.sim.gel.presses import Presses

    begun = time.perf_counter()
    of = ObjectFile.open(folder)
    touch = open_touch(of, level)
    require_gel(of, touch.entry.gel, by.gel.sensor, by.gel.calibration.header.skirt)
    place = places.pressed_place(of.mesh, contact, vertex)
    # The first press makes ready what all that follow use.
    _pressed(of, touch, place, by)
    loaded, begun = time.perf_counter() - begun, time.perf_counter()
    press = _pressed(of, touch, place, by)
    seconds = {"load": loaded, "render": time.perf_counter() - begun}
    exact = touch if level == "reference" else open_touch(of, "reference")
    assert isinstance(exact.maps, ReferenceMaps)
    exact.maps.require_clear(Presses.one(place.point, place.normal, *by.pose))
    if level == "reference":
        return RenderedPress(of, touch, place, by.pose, press, None, seconds)
    begun = time.perf_counter()
    reference = _pressed(of, exact, place, by)
    seconds["reference"] = time.perf_counter() - begun
    return RenderedPress(of, touch, place, by.pose, press, reference, seconds)


def _pressed(of: "ObjectFile", touch: "ObjectTouch", place: "ContactPlace", by: _Pressing) -> "Press":
    from harness.basics.toml_file import validate
    from harness.bench.scene import SceneFile
    from harness.effects.touch_press import press_heights
    from harness.sim.gel.presses import Presses

    surface = touch.at(Presses.one(place.point, place.normal, *by.pose))[0]
    what = {"mesh": str(of.folder / of.description.mesh.file), "material": "steel"}
    scene = validate({"schema": 1, "object": what}, SceneFile, "the options")
    return press_heights(surface, "gel", by.gel, scene, by.levels, force=by.force)


def _level(text: str) -> "TouchLevel":
    from harness.basics.errors import WrongUse

    match text:
        case "codes" | "perceptron" | "reference":
            return text
    raise WrongUse(
        f"no level {text!r} of a touch; --level takes codes, perceptron, or reference for the mesh's"
    )


def _write_heights(path: Path, rendered: RenderedPress) -> None:
    from harness.basics.npz_file import write_array

    write_array(path, rendered.press.surface)
