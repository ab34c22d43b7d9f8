"""``touchstone object render touch``: what a gel's camera sees of a press onto an object."""

import math
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from harness.commands import force_options as forces
from harness.commands import options, places
from harness.commands.force_options import force_json, force_row, press_force_notes
from harness.commands.output import ANSWERS, emit, warn

if TYPE_CHECKING:
    from harness.effects.touch_press import Press
    from harness.objectfile.file import ObjectFile
    from harness.objectfile.touch.touch import ObjectTouch, TouchLevel
    from harness.sim.gel.press_pose import ContactPlace
    from harness.sim.optics.known_gel import Gel


@dataclass(frozen=True, eq=False)
class RenderedPress:
    """A press, and all that is said of it."""

    of: "ObjectFile"  #: the object.
    touch: "ObjectTouch"  #: its touch at a level.
    place: "ContactPlace"  #: that was pressed.
    pose: tuple[float, float, float, float]  #: depth in m; tilt, azimuth and yaw in rad.
    press: "Press"  #: drawn from that level.
    reference: "Press | None"  #: drawn from the rasteriser; None where that is the level.
    seconds: dict[str, float]  #: s on the clock by stage.


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
        typer.Option(help="Where the map comes from: codes, or reference (the mesh's rasteriser)."),
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

    The surface of the gel comes from the object's codes; beside it stands what the rasteriser makes of its
    mesh, and how far the one is from the other. A depth, tilt or place that the codes were not made for is
    refused.

    Try: touchstone object render touch objects/mug --contact -0.04 0 0.05 --tilt 5deg --out touch.png
    """
    from harness.basics.npz_file import write_array
    from harness.basics.quantities import ANGLE, LENGTH
    from harness.picture.image_file import write_png
    from harness.sim.optics.known_gel import known_gel

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
    elastic = forces.stiffness(gel_modulus, gel_modulus_error, gel_poisson)
    gel = replace(known_gel(sensor, calibration, shadow=False), elastic=elastic, forces=table)
    pressing = _Pressing(gel, (deep, tilted, towards, turned), levels, force)
    rendered = _rendered(folder, _level(level), contact, vertex, pressing)
    write_png(out, rendered.press.image)
    if height_out is not None:
        write_array(height_out, rendered.press.surface)
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
    """What presses."""

    gel: "Gel"  #: that is pressed.
    pose: tuple[float, float, float, float]  #: depth in m; tilt, azimuth and yaw in rad.
    levels: list[str]  #: of its force.
    force: bool  #: whether that is computed.


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
    from harness.sim.gel.press_pose import Presses

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
    from harness.sim.gel.press_pose import Presses

    surface = touch.at(Presses.one(place.point, place.normal, *by.pose))[0]
    what = {"mesh": str(of.folder / of.description.mesh.file), "material": "steel"}
    scene = validate({"schema": 1, "object": what}, SceneFile, "the options")
    return press_heights(surface, "gel", by.gel, scene, by.levels, force=by.force)


def _level(text: str) -> "TouchLevel":
    from harness.basics.errors import WrongUse

    match text:
        case "codes" | "reference":
            return text
        case "perceptron":
            raise WrongUse("touch no longer has the level 'perceptron'; take --level codes")
    raise WrongUse(f"no level {text!r} of a touch; --level takes codes, or reference for the mesh's")


def beside_the_mesh(rendered: RenderedPress) -> dict[str, float | None] | None:
    """How far map and picture are from the rasteriser's; None where that is the level.

    Root mean square, 99th percentile and greatest difference of the maps, m; of the pictures, grey levels and
    dB, where equal pictures have no dB; of the forces N, None where none was asked for.
    """
    import numpy as np

    from harness.picture.image_metrics import mean_square, psnr

    if rendered.reference is None:
        return None
    apart = np.abs(rendered.press.surface - rendered.reference.surface)
    image, truth = rendered.press.image, rendered.reference.image
    decibels = psnr(image, truth)
    forces = rendered.press.force, rendered.reference.force
    harder = None if forces[0] is None or forces[1] is None else forces[0].newtons[0] - forces[1].newtons[0]
    return {
        "rms_m": float(np.sqrt((apart**2).mean())),
        "p99_m": float(np.quantile(apart, 0.99)),
        "most_m": float(apart.max()),
        "image_rms_grey": math.sqrt(mean_square(image, truth)),
        "image_psnr_db": decibels if math.isfinite(decibels) else None,
        "force_n": None if harder is None else float(harder),
    }


def notes(rendered: RenderedPress) -> list[str]:
    """What the operator should know."""
    said, press = [], rendered.press
    if rendered.place.moved > 0.0:
        said.append(f"the contact was moved {rendered.place.moved * 1e3:.3g} mm onto the surface")
    if press.touches_border:
        said.append("the contact reaches the edge of the window; there is more of it than is seen")
    return said + press_force_notes(press)


def draw(rendered: RenderedPress, path: Path) -> None:
    """Write the picture; it counts among the seconds."""
    from harness.report.figures.figures import Album
    from harness.report.figures.touch import LevelPictures, levels_figure

    begun, press, reference = time.perf_counter(), rendered.press, rendered.reference
    shown = LevelPictures(
        level=rendered.touch.level,
        heights=press.surface,
        image=press.image,
        background=press.gel.calibration.background,
        reference=None if reference is None else (reference.surface, reference.image),
        pitch=press.gel.sensor.pitch,
        words=(_title(rendered), _apart(rendered)),
    )
    Album(path.parent).photograph(path.stem, levels_figure(shown))
    rendered.seconds["picture"] = time.perf_counter() - begun


def as_json(
    rendered: RenderedPress, out: Path, picture: Path | None, height_out: Path | None
) -> dict[str, Any]:
    """As scripts read it."""
    press, place, gel = rendered.press, rendered.place, rendered.touch.entry.gel
    header = press.gel.calibration.header
    angles = zip(("depth_m", "tilt_rad", "azimuth_rad", "yaw_rad"), rendered.pose, strict=True)
    return {
        "schema": 1,
        "folder": str(rendered.of.folder),
        "object": rendered.of.description.name,
        "level": rendered.touch.level,
        "image": str(out),
        "picture": None if picture is None else str(picture),
        "height_out": None if height_out is None else str(height_out),
        "sensor": gel.name,
        "calibration": {
            "made_from": header.made_from,
            "sha256": press.gel.calibration.sha256,
        },
        "rows": gel.rows,
        "columns": gel.columns,
        "pitch_m": gel.pitch_m,
        **dict(angles),
        "point_m": place.point.tolist(),
        "normal": place.normal.tolist(),
        "moved_m": place.moved,
        "contact_pixels": int(press.contact.sum()),
        "deepest_m": press.deepest,
        **force_json(press),
        "flags": {
            "touches_border": press.touches_border,
            "saturated_values": press.saturated,
            "out_of_domain_share": press.out_of_domain,
        },
        "error_estimate": {
            "from_mesh": beside_the_mesh(rendered),
            "maps_measured": dict(rendered.touch.measured),
            "colours_residual_rms_grey": header.residual_rms if math.isfinite(header.residual_rms) else None,
        },
        "notes": notes(rendered),
        "seconds": rendered.seconds,
    }


def print_answer(rendered: RenderedPress, out: Path, picture: Path | None) -> None:
    """For people."""
    ANSWERS.print(_title(rendered), markup=False)
    pixels, deepest = int(rendered.press.contact.sum()), 1e3 * rendered.press.deepest
    ANSWERS.print(f"{pixels} pixels in contact, {deepest:.3f} mm at the deepest")
    if (pressed := force_row(rendered.press)) is not None:
        ANSWERS.print(pressed, markup=False)
    ANSWERS.print(_apart(rendered), markup=False)
    for path in (out, picture):
        if path is not None:
            ANSWERS.print(str(path), markup=False)
    took = ", ".join(f"{stage} {1e3 * seconds:.1f} ms" for stage, seconds in rendered.seconds.items())
    ANSWERS.print(took, markup=False)


def _title(rendered: RenderedPress) -> str:
    x, y, z = (round(1e3 * float(value), 2) + 0.0 for value in rendered.place.point)
    depth, tilt, azimuth, yaw = rendered.pose
    leant, towards, turned = (math.degrees(angle) for angle in (tilt, azimuth, yaw))
    return (
        f"{rendered.of.description.name} pressed at ({x:g}, {y:g}, {z:g}) mm, {depth * 1e3:g} mm deep, "
        f"tilted {leant:.3g} deg towards {towards:.3g} deg, turned {turned:.3g} deg; {rendered.touch.level}"
    )


def _apart(rendered: RenderedPress) -> str:
    found = beside_the_mesh(rendered)
    if found is None:
        return "by the rasteriser, which the other levels are measured against"
    decibels = found["image_psnr_db"]
    picture = "the same picture" if decibels is None else f"{decibels:.1f} dB of the picture"
    rms, high = (1e6 * (found[key] or 0.0) for key in ("rms_m", "p99_m"))
    return f"from the rasteriser on the mesh: {rms:.3g} um rms, {high:.3g} um in 99 of 100 pixels, {picture}"
