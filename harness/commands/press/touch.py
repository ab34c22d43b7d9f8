"""``touchstone sim touch``: what a gel shows of a height map, or of a mesh that it is pressed onto."""

import time
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from harness.commands import force_options as forces
from harness.commands import options, places
from harness.commands.output import emit, warn
from harness.commands.press import touch_sources as sources
from harness.commands.press.touch_answer import Touched, as_json, draw, print_answer
from harness.commands.press.touch_sources import refuse


def touch(
    mesh: Annotated[
        str | None,
        typer.Argument(
            help="A mesh file, builtin:mug and so on, or an ObjectFile; or give --height.",
            metavar="MESH",
            callback=options.check_touched,
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
            help="Of a mesh: the object's ObjectFile, for --level touch.shapes=network or =perceptron.",
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
    out = _checked_files(out, picture, height_out, pressure_out)
    own = {"--gel-poisson": gel_poisson, "--force-table": force_table, "--pressure-out": pressure_out}
    forces.require_force(force, level or [], gel_modulus, gel_modulus_error, **own)
    begun = time.perf_counter()
    if shadow is None and heights_of == "gel" and reached is None:
        shadow = False
    gel = sources.gel(sensor, calibration, pitch, thickness, background, shadow, noise, seed, markers)
    table, levels = forces.measured(force_table, level or [])
    gel = replace(gel, elastic=forces.stiffness(gel_modulus, gel_modulus_error, gel_poisson), forces=table)
    loaded = time.perf_counter() - begun
    if (mesh is None) == (height is None):
        refuse("say what is pressed: either a MESH with --contact X Y Z, or --height FILE.npy")
    if height is not None:
        of_mesh = (contact, vertex, depth, tilt, azimuth, yaw, units, up_axis, objectfile)
        if any(given is not None for given in of_mesh):
            refuse(
                "--contact, --vertex, --depth, --tilt, --azimuth, --yaw, --units, --up-axis and --objectfile "
                "are of a mesh; --height is a map"
            )
        touched = sources.of_heights(height, heights_of, reached, gel, levels, force)
    else:
        if (contact is None and vertex is None) or heights_of != "object" or reached is not None:
            refuse(
                "a mesh needs --contact X Y Z or --vertex N, and --heights-of and --reached are of --height"
            )
        assert mesh is not None
        pose = (depth, tilt, azimuth, yaw)
        touched = sources.of_mesh(
            mesh, (units, up_axis), contact, vertex, pose, gel, levels, objectfile, force
        )
    if pressure_out is not None:
        _write_pressure(pressure_out, touched)
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
    from harness.picture.image_file import read_image, write_png
    from harness.picture.square_pixels import made_square

    seen = None if live is None else made_square(read_image(live), touched.press.gel.aspect)
    whole = touched.compared(seen, before)
    write_png(out, whole.press.image)
    if height_out is not None:
        _write_heights(height_out, whole)
    if picture is not None:
        draw(whole, picture)
    for sentence in whole.notes:
        warn(sentence)
    if json:
        emit(as_json(whole, out, picture, height_out))
    else:
        print_answer(whole, out, picture)
    return 0


def _checked_files(
    out: Path | None, picture: Path | None, height_out: Path | None, pressure_out: Path | None
) -> Path:
    if out is None:
        refuse("say where the picture goes: --out FILE.png")
    options.require_files(
        ("--out", out, ".png"),
        ("--picture", picture, ".png"),
        ("--height-out", height_out, ".npy"),
        ("--pressure-out", pressure_out, ".npy"),
    )
    return out


def _write_pressure(path: Path, touched: Touched) -> None:
    from harness.basics.npz_file import write_array

    found = touched.press.force
    assert found is not None
    if touched.press.levels[forces.LEVEL] == "table":
        refuse("a table of forces says how much, not where; leave --pressure-out out, or --force-table")
    write_array(path, found.pressure[0])


def _write_heights(path: Path, touched: Touched) -> None:
    import numpy as np

    from harness.basics.npz_file import write_array

    heights, missing = touched.press.heights, touched.press.missing
    write_array(path, heights if missing is None else np.where(missing, np.nan, heights))
