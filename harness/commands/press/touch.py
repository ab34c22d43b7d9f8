"""``touchstone sim touch``: what a gel shows of a height map, or of a mesh that it is pressed onto."""

from pathlib import Path
from typing import Annotated

import typer

from harness.commands import options, places
from harness.commands import press_options as presses
from harness.commands.output import print_result


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
    sensor: presses.Sensor = None,
    calibration: presses.Calibration = None,
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
    contact: presses.Contact = None,
    vertex: places.VertexOption = None,
    depth: presses.Depth = None,
    tilt: presses.Tilt = None,
    azimuth: presses.Azimuth = None,
    yaw: presses.Yaw = None,
    units: options.Units = None,
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
    force: presses.Force = False,
    gel_modulus: presses.Modulus = None,
    gel_modulus_error: presses.ModulusError = None,
    gel_poisson: presses.Poisson = None,
    force_table: presses.Table = None,
    pressure_out: presses.PressureOut = None,
    json: options.Json = False,
) -> int:
    """What the camera behind a gel sees of a press.

    Only what the sensor calls for is computed. Without a contact the picture is that of the untouched gel
    to the bit, and it is said.

    Try: touchstone sim touch builtin:mug --contact -0.04 0 0.05 --depth 1mm --tilt 5deg --out touch.png
    """
    from harness import api
    from harness.basics.errors import WrongUse
    from harness.basics.quantities import LENGTH

    if out is None:
        raise WrongUse("no file for the picture; add --out FILE.png")
    options.require_files(
        ("--out", out, ".png"),
        ("--picture", picture, ".png"),
        ("--height-out", height_out, ".npy"),
        ("--pressure-out", pressure_out, ".npy"),
    )
    stiffness = gel_modulus, gel_modulus_error, gel_poisson
    gel = presses.read_stiffness(
        force, level or (), *stiffness, force_table=force_table, pressure_out=pressure_out
    )
    of_mesh = (contact, vertex, depth, tilt, azimuth, yaw, units, up_axis, objectfile)
    if mesh is None and height is not None and any(given is not None for given in of_mesh):
        raise WrongUse(
            "--contact, --vertex, --depth, --tilt, --azimuth, --yaw, --units, --up-axis and --objectfile "
            "are of a mesh; --height is a map"
        )
    rendered = api.render_touch(
        mesh,
        vertex=vertex,
        **presses.read_pose(contact, depth, tilt, azimuth, yaw),
        height=height,
        heights_of=heights_of,
        reached=reached,
        units=units,
        up_axis=up_axis,
        objectfile=objectfile,
        sensor=sensor,
        calibration=calibration,
        pitch=options.positive("--pitch", pitch, LENGTH),
        thickness=options.positive("--thickness", thickness, LENGTH),
        background=background,
        shadow=shadow,
        markers=markers,
        noise=noise,
        seed=seed,
        accuracy=level or (),
        gel=gel,
        force_table=force_table,
        live=live,
        out=out,
        height_out=height_out,
        pressure_out=pressure_out,
        picture=picture,
    )
    print_result(rendered, json)
    return 0
