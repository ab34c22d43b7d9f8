"""``touchstone depth``: how deep a gel is pressed, from live pictures, with the error of every pixel."""

from pathlib import Path
from typing import Annotated

import typer

from harness.commands import options
from harness.commands import press_options as presses
from harness.commands.output import print_result


def depth(
    images: Annotated[
        list[Path],
        typer.Argument(
            help="What the camera saw of one press that was held still; of several frames the mean is read.",
            metavar="IMAGE...",
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            help="Arrays without pickles: height, sigma (metres), contact, trusted, points, points_sigma. "
            "Without it the figures are only printed.",
            metavar="FILE.npz",
        ),
    ] = None,
    calibration: Annotated[
        str | None,
        typer.Option(
            help="As calibrate taxim wrote it, or a shipped one's name; that of --station if left out.",
            metavar="FILE",
        ),
    ] = None,
    background: Annotated[
        Path | None,
        typer.Option(
            help="Picture of the untouched gel, taken just before the press. The calibration's if left out, "
            "with a note.",
            metavar="IMAGE",
        ),
    ] = None,
    sensor: Annotated[
        str | None,
        typer.Option(
            help="Sensor whose gel is pressed: a shipped name or a sensor file. Its thickness bounds the "
            "depth. If left out, that of --station, or the shipped one that the calibration names.",
            metavar="NAME",
        ),
    ] = None,
    station: Annotated[
        str | None,
        typer.Option(
            help="A bench: points are then in the frame of its arm's flange, else in the gel's own.",
            metavar="NAME",
        ),
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(help="Live picture, heights and their error.", metavar="FILE.png")
    ] = None,
    height_out: Annotated[
        Path | None,
        typer.Option(
            help="The heights alone, as `sim touch --heights-of gel` takes them.", metavar="FILE.npy"
        ),
    ] = None,
    force: presses.Force = False,
    thickness: Annotated[
        str | None,
        typer.Option(
            help="Thickness of the gel, for --force; that of the sensor if left out.", metavar="LENGTH"
        ),
    ] = None,
    gel_modulus: presses.Modulus = None,
    gel_modulus_error: presses.ModulusError = None,
    gel_poisson: presses.Poisson = None,
    json: options.Json = False,
) -> int:
    """Read the surface of a pressed gel from what its camera saw.

    Every pixel has its height and one standard deviation of it: by the camera's noise, the calibration's own
    misfit, slopes steeper than it knows, and what a contact itself does to the colour.

    Try: touchstone depth press.png --background rest.png --calibration gelsight_r15_bench --picture d.png
    """
    from harness import api
    from harness.basics.quantities import LENGTH

    options.require_files(
        ("--out", out, ".npz"), ("--picture", picture, ".png"), ("--height-out", height_out, ".npy")
    )
    measured = api.depth(
        images,
        calibration=calibration,
        background=background,
        sensor=sensor,
        station=station,
        gel=presses.read_stiffness(
            force, (), gel_modulus, gel_modulus_error, gel_poisson, thickness=thickness
        ),
        thickness=options.positive("--thickness", thickness, LENGTH),
        out=out,
        height_out=height_out,
        picture=picture,
    )
    print_result(measured, json)
    return 0
