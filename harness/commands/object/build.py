"""``touchstone object build``: from a mesh to an ObjectFile."""

from pathlib import Path
from typing import Annotated

import typer

from harness.commands import options
from harness.commands.output import print_result, share_progress


def build(
    mesh: options.MeshArgument,
    out: Annotated[Path, typer.Option(help="The ObjectFile's folder.", metavar="FOLDER")],
    material: Annotated[str, typer.Option(help="What it is made of.", metavar="M")],
    only: Annotated[str, typer.Option(help="Which modality: audio, touch or vision.")] = "audio",
    profile: Annotated[
        str,
        typer.Option(
            help="smoke, shipped (of the fewest bytes), standard, or, of vision, paper: networks of its size."
        ),
    ] = "standard",
    units: options.Units = None,
    up_axis: options.UpAxis = None,
    wall: options.Wall = None,
    up_to: options.UpTo = "20kHz",
    modes: options.MostModes = 128,
    edge: options.LongestEdge = None,
    licence: Annotated[str, typer.Option(help="Of the mesh, and so of the ObjectFile.")] = "unknown",
    seed: Annotated[int, typer.Option(help="Of everything random.", min=0)] = 0,
    threads: Annotated[
        int | None,
        typer.Option(
            help="Of the fit or training: 1, and as many as cores for vision.",
            min=1,
        ),
    ] = None,
    sensor: Annotated[
        str | None,
        typer.Option(
            help="Of touch: the make that presses, by its name, gelsight-r1.5 if left out, or the path of a "
            "sensor's own file.",
            metavar="NAME",
        ),
    ] = None,
    json: options.Json = False,
) -> int:
    """Build an object's sound, touch or look: networks, and their errors where they never looked.

    Sound: a tenth of the nodes is held out. Errors there stand beside those of the nearest trained vertex,
    of linear interpolation, and of a float16 table at its own nodes. A stopped build goes on when it is
    called again: solved modes are kept in the cache.

    Touch: the surface is coded, and its maps of presses that were never shown are compared with the
    simulator's (PSNR of 2 mm), beside the nearest coded place's and an untouched gel. --up-to, --modes and
    --edge are of sound alone.

    Vision: tiny networks of the file's own colours, as the mesh's texture says them, measured on pictures
    whose cameras and lights were kept back. A stopped training goes on when it is called again.

    Try: touchstone object build builtin:bowl --material ceramic --profile smoke --out my/bowl
    """
    options.require_folders(("--out", out))
    from harness import api
    from harness.basics.quantities import FREQUENCY, LENGTH

    with share_progress(quiet=json) as report:
        built = api.build_objectfile(
            mesh,
            out,
            material,
            only,
            profile,
            units=units,
            up_axis=up_axis,
            wall=options.quantity("--wall", wall, LENGTH),
            up_to=options.quantity("--up-to", up_to, FREQUENCY),
            count=modes,
            edge=options.quantity("--edge", edge, LENGTH),
            licence=licence,
            seed=seed,
            threads=threads,
            sensor=sensor,
            report=report,
        )
    print_result(built, json)
    return 0
