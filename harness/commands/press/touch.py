"""``touchstone sim touch``: what a gel shows of a height map, or of a mesh that it is pressed onto."""

import math
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from harness.commands import force_options as forces
from harness.commands import options, places
from harness.commands.output import emit, warn
from harness.commands.press.touch_answer import Touched, as_json, draw, print_answer

if TYPE_CHECKING:
    from harness.bench.scene import SceneFile
    from harness.effects.quantities import Quantities
    from harness.sim.gel.height_file import Heights
    from harness.sim.optics.known_gel import Gel


def touch(
    mesh: Annotated[
        str | None,
        typer.Argument(
            help="A mesh file, builtin:mug and so on, or an ObjectFile; or give --height.",
            metavar="MESH",
            callback=options.check_object,
        ),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="The picture, 8 bits RGB.", metavar="FILE.png")] = None,
    height: Annotated[
        Path | None,
        typer.Option(
            help="A height map in place of a mesh: (rows, columns) float metres of indentation, positive "
            "into the gel, 0 where it is not reached, NaN where it is not known, in gel coordinates (x along "
            "columns, y along rows).",
            metavar="FILE.npy",
        ),
    ] = None,
    heights_of: Annotated[
        str,
        typer.Option(
            help="What --height is of: object, how deep the object reaches, and the gel's skirt is drawn; "
            "gel, the surface of the gel itself.",
            metavar="WHAT",
        ),
    ] = "object",
    reached: Annotated[
        Path | None,
        typer.Option(
            help="Beside the surface of a gel: how deep the object itself reaches, which shadows start from.",
            metavar="FILE.npy",
        ),
    ] = None,
    sensor: Annotated[
        str | None,
        typer.Option(
            help="A make by its name, gelsight-r1.5 if nothing else is said, or the path of a sensor's own "
            "file; a name that is not known is answered by all that are.",
            metavar="NAME",
        ),
    ] = None,
    calibration: Annotated[
        str | None,
        typer.Option(
            help="A calibration file, a shipped one's name, or a folder of Taxim's or ObjectFolder's; the "
            "sensor's own if left out.",
            metavar="FILE",
        ),
    ] = None,
    pitch: Annotated[
        str | None, typer.Option(help="Of a pixel, where a published calibration is read.", metavar="LENGTH")
    ] = None,
    thickness: Annotated[
        str | None, typer.Option(help="Of the gel, in place of the make's.", metavar="LENGTH")
    ] = None,
    background: Annotated[
        Path | None,
        typer.Option(help="Picture of the untouched gel, in place of the calibration's.", metavar="IMAGE"),
    ] = None,
    shadow: Annotated[
        bool | None,
        typer.Option(
            help="Draw shadows, or not. Left out: if a table of them came with the calibration, and it is "
            "known where the object touches."
        ),
    ] = None,
    markers: Annotated[
        Path | None,
        typer.Option(help="Dots of the very gel, as calibrate markers wrote them.", metavar="FILE.json"),
    ] = None,
    contact: Annotated[
        places.Coordinates | None,
        typer.Option(
            help="Of a mesh: where, in the mesh file's frame: metres, or each with its unit.", metavar="X Y Z"
        ),
    ] = None,
    vertex: Annotated[
        int | None, typer.Option(help="Or at a vertex of the mesh, counted from 0.", metavar="N")
    ] = None,
    depth: Annotated[
        str | None,
        typer.Option(
            help="Of a mesh: how deep the gel's centre is pressed on, 1mm if left out.", metavar="L"
        ),
    ] = None,
    tilt: Annotated[
        str | None,
        typer.Option(help="Of a mesh: between the gel's axis and the normal, 0deg if left out.", metavar="A"),
    ] = None,
    azimuth: Annotated[
        str | None,
        typer.Option(help="Of a mesh: which way it is tilted, from the gel's x at no yaw.", metavar="A"),
    ] = None,
    yaw: Annotated[
        str | None, typer.Option(help="Of a mesh: the sensor turned about its own axis.", metavar="A")
    ] = None,
    units: Annotated[
        str | None, typer.Option(help="Of the mesh file's numbers: m, cm, mm, um, in or ft.", metavar="U")
    ] = None,
    up_axis: options.UpAxis = None,
    objectfile: Annotated[
        Path | None,
        typer.Option(
            help="Of a mesh: the object's ObjectFile, for --level touch.shapes=network.",
            metavar="FOLDER",
        ),
    ] = None,
    level: Annotated[
        list[str] | None,
        typer.Option(
            help="Turn one dial, as touch.optics=exact; may be given again. touch.shapes, touch.gel, "
            "touch.supersampling, touch.optics, touch.marker_motion; with --force touch.force and "
            "touch.force_cells.",
            metavar="D=L",
        ),
    ] = None,
    noise: Annotated[float, typer.Option(help="Sigma of the camera's noise in grey levels.", min=0.0)] = 0.0,
    seed: Annotated[int, typer.Option(help="Of the noise.", min=0)] = 0,
    live: Annotated[
        Path | None, typer.Option(help="What a camera saw, to be compared with.", metavar="IMAGE")
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(help="Heights, colours and differences side by side.", metavar="FILE.png")
    ] = None,
    height_out: Annotated[
        Path | None,
        typer.Option(help="The height map that was drawn, as --height takes it.", metavar="FILE.npy"),
    ] = None,
    force: forces.Force = False,
    gel_modulus: forces.Modulus = None,
    gel_modulus_error: forces.ModulusError = None,
    gel_poisson: forces.Poisson = None,
    force_table: forces.Table = None,
    pressure_out: forces.PressureOut = None,
    json: options.Json = False,
) -> int:
    """What the camera behind a gel sees of a press.

    Only what the sensor calls for is computed. Without a contact the picture is that of the untouched gel
    to the bit, and it is said.

    Try: touchstone sim touch builtin:mug --contact -0.04 0 0.05 --depth 1mm --tilt 5deg --out touch.png
    """
    if out is None:
        _refuse("say where the picture goes: --out FILE.png")
    options.require_files(
        ("--out", out, ".png"),
        ("--picture", picture, ".png"),
        ("--height-out", height_out, ".npy"),
        ("--pressure-out", pressure_out, ".npy"),
    )
    own = {"--gel-poisson": gel_poisson, "--force-table": force_table, "--pressure-out": pressure_out}
    forces.require_force(force, level or [], gel_modulus, gel_modulus_error, **own)
    begun = time.perf_counter()
    if shadow is None and heights_of == "gel" and reached is None:
        shadow = False
    gel = _described_gel(sensor, calibration, pitch, thickness, background, shadow, noise, seed, markers)
    table, levels = forces.measured(force_table, level or [])
    gel = replace(gel, elastic=forces.stiffness(gel_modulus, gel_modulus_error, gel_poisson), forces=table)
    loaded = time.perf_counter() - begun
    if (mesh is None) == (height is None):
        _refuse("say what is pressed: either a MESH with --contact X Y Z, or --height FILE.npy")
    if height is not None:
        of_mesh = (contact, vertex, depth, tilt, azimuth, yaw, units, up_axis, objectfile)
        if any(given is not None for given in of_mesh):
            _refuse(
                "--contact, --vertex, --depth, --tilt, --azimuth, --yaw, --units, --up-axis and --objectfile "
                "are of a mesh; --height is a map"
            )
        touched = _press_heights(height, heights_of, reached, gel, levels, force)
    else:
        if (contact is None and vertex is None) or heights_of != "object" or reached is not None:
            _refuse(
                "a mesh needs --contact X Y Z or --vertex N, and --heights-of and --reached are of --height"
            )
        assert mesh is not None
        pose = (depth, tilt, azimuth, yaw)
        touched = _press_mesh(mesh, (units, up_axis), contact, vertex, pose, gel, levels, objectfile, force)
    if pressure_out is not None:
        from harness.basics.npz_file import write_array

        assert touched.press.force is not None
        if touched.press.plan.levels[forces.LEVEL] == "table":
            _refuse("a table of forces says how much, not where; leave --pressure-out out, or --force-table")
        write_array(pressure_out, touched.press.force.pressure[0])
    return _finish(touched, {"calibration": loaded}, out, live, picture, height_out, json)


def _finish(
    touched: Touched,
    before: dict[str, float],
    out: Path,
    live: Path | None,
    picture: Path | None,
    height_out: Path | None,
    json: bool,
) -> int:
    import numpy as np

    from harness.basics.npz_file import write_array
    from harness.picture.image_file import read_image, write_png
    from harness.picture.square_pixels import made_square

    seen = None if live is None else made_square(read_image(live), touched.press.gel.aspect)
    whole = touched.compared(seen, before)
    write_png(out, whole.press.image)
    if height_out is not None:
        heights, missing = whole.press.heights, whole.press.missing
        write_array(height_out, heights if missing is None else np.where(missing, np.nan, heights))
    if picture is not None:
        draw(whole, picture)
    for sentence in whole.notes:
        warn(sentence)
    if json:
        emit(as_json(whole, out, picture, height_out))
    else:
        print_answer(whole, out, picture)
    return 0


def _refuse(sentence: str) -> NoReturn:
    """Raise ``WrongUse``."""
    from harness.basics.errors import WrongUse

    raise WrongUse(sentence)


def _described_gel(
    sensor: str | None,
    calibration: str | None,
    pitch: str | None,
    thickness: str | None,
    background: Path | None,
    shadow: bool | None,
    noise: float,
    seed: int,
    markers: Path | None = None,
) -> "Gel":
    """The gel that the options describe; ``WrongUse`` and ``CalibrationRefused`` as ``known_gel``."""
    from dataclasses import replace

    from harness.basics.quantities import LENGTH
    from harness.picture.image_file import read_image
    from harness.sim.gel.markers import read_markers
    from harness.sim.optics.known_gel import known_gel

    gel = known_gel(
        sensor,
        calibration,
        pitch=options.positive("--pitch", pitch, LENGTH),
        thickness=options.positive("--thickness", thickness, LENGTH),
        background=None if background is None else read_image(background),
        shadow=shadow,
    )
    if not math.isfinite(noise):
        _refuse(f"--noise of {noise} grey levels cannot be drawn; give a finite number")
    gel = replace(gel, noise=noise, seed=seed)
    return gel if markers is None else gel.with_dots(read_markers(markers))


def _press_heights(
    path: Path, of: str, under: Path | None, gel: "Gel", levels: list[str], force: bool = False
) -> Touched:
    """The press of a height map; ``under`` is how deep the object reaches below a gel's surface."""
    from harness.effects.touch_press import press_heights
    from harness.sim.gel.height_file import read_heights

    if of not in ("object", "gel"):
        _refuse(f"--heights-of {of} is no kind of height map; there are object and gel")
    kind: Heights = "object" if of == "object" else "gel"
    begun = time.perf_counter()
    given = read_heights(path, gel.sensor, kind)
    if under is not None and kind == "object":
        _refuse("--reached stands beside the surface of a gel; an object's --height says it already")
    reached = None if under is None else read_heights(under, gel.sensor)
    read = time.perf_counter() - begun
    missing = given.missing if reached is None else given.missing | reached.missing
    touched = None if reached is None else reached.heights
    scene = _scene(str(path), (None, None), gel)
    press = press_heights(given.heights, kind, gel, scene, levels, touched, missing, force)
    return Touched(press, str(path), seconds={"read": read})


def _press_mesh(
    mesh: str,
    file: tuple[str | None, str | None],
    contact: places.Coordinates | None,
    vertex: int | None,
    pose: tuple[str | None, str | None, str | None, str | None],
    gel: "Gel",
    levels: list[str],
    objectfile: Path | None = None,
    force: bool = False,
) -> Touched:
    """Press a mesh onto a gel.

    Args:
        mesh: a file, a built-in object or an ObjectFile.
        file: unit of the file's numbers and axis that points up; None where left out.
        contact: where it is pressed, or None.
        vertex: number of the vertex where it is pressed, or None.
        pose: depth, tilt, azimuth and yaw with their units; None where left out.
        gel: onto which it is pressed.
        levels: of knobs.
        objectfile: folder of the object's networks.
        force: whether the force is computed.
    """
    from harness.basics.quantities import ANGLE, LENGTH
    from harness.effects.scene_object import known_object
    from harness.effects.touch_press import press_gel
    from harness.sim.gel.press_pose import Presses, gel_from_object

    depth = options.quantity("--depth", pose[0] or "1mm", LENGTH)
    tilt, azimuth, yaw = (
        options.quantity(option, text or "0deg", ANGLE)
        for option, text in zip(("--tilt", "--azimuth", "--yaw"), pose[1:], strict=True)
    )
    begun = time.perf_counter()
    scene = _scene(mesh, file, gel, objectfile)
    known = known_object(scene)
    place = places.pressed_place(known.mesh, contact, vertex)
    at = gel_from_object(place, depth, tilt, azimuth, yaw, gel.sensor.gel_thickness)
    read = time.perf_counter() - begun
    sources: Quantities = {
        "object_mesh": known.mesh,
        "contact_gel_from_object": at[None],
        "contact_presses": Presses.one(place.point, place.normal, depth, tilt, azimuth, yaw),
    }
    press = press_gel(sources, gel, scene, levels, force)
    asked = {"depth_m": depth, "tilt_rad": tilt, "azimuth_rad": azimuth, "yaw_rad": yaw}
    return Touched(press, mesh, place, at, asked, (*known.read, *known.warnings), seconds={"mesh": read})


def _scene(
    what: str, file: tuple[str | None, str | None], gel: "Gel", objectfile: Path | None = None
) -> "SceneFile":
    """A table with nothing on it but what is touched; touch does not depend on its material."""
    from harness.basics.toml_file import validate
    from harness.bench.scene import SceneFile, scene_from_options
    from harness.bench.scene_objectfile import holds_objectfile, objectfile_folder
    from harness.objects.builtin import BUILTIN

    if what.endswith(".npy"):
        tree = {"schema": 1, "object": {"mesh": what, "material": "steel"}}
        scene = validate(tree, SceneFile, "the options")
    else:
        says_its_own = what.startswith(BUILTIN) or holds_objectfile(objectfile_folder(what, Path.cwd()))
        material = None if says_its_own else "steel"
        named = None if objectfile is None else str(objectfile)
        scene = scene_from_options(what, material, file[0], objectfile=named, up_axis=file[1])
    return scene.model_copy(update={"sensors": scene.sensors.model_copy(update={"noise": gel.noise > 0.0})})
