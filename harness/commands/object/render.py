"""``touchstone object render audio``: what a strike at a place of an object sounds like."""

from pathlib import Path
from typing import Annotated

import typer

from harness.commands import options, places
from harness.commands.output import print_result

Three = tuple[float, float, float]


def render(
    folder: options.ObjectFolder,
    out: Annotated[Path, typer.Option(help="The sound, 24 bits.", metavar="FILE.wav")],
    at: Annotated[
        places.Coordinates | None,
        typer.Option(
            help="Where it is struck, in the object's frame: metres, or each with its unit.", metavar="X Y Z"
        ),
    ] = None,
    vertex: places.VertexOption = None,
    force: Annotated[
        Three | None,
        typer.Option(
            help="On the object: N s of an impulse, N at most of a pulse; 1 inward if left out.",
            metavar="X Y Z",
        ),
    ] = None,
    impulse: Annotated[
        bool, typer.Option("--impulse", help="All of it in one instant; so if nothing else is said.")
    ] = False,
    hammer: Annotated[
        str | None, typer.Option(help="A round tip, by Hertz: steel, nylon or rubber.", metavar="NAME")
    ] = None,
    contact_time: Annotated[
        str | None, typer.Option(help="A tip just so hard that it stays that long, as 0.3ms.", metavar="T")
    ] = None,
    tip_radius: Annotated[
        str | None, typer.Option(help="Of the hammer, in place of its own, as 5mm.", metavar="L")
    ] = None,
    hammer_mass: Annotated[
        str | None, typer.Option(help="Of the hammer, in place of its own, as 20g.", metavar="M")
    ] = None,
    speed: Annotated[
        str | None,
        typer.Option(help="Of the hammer, as 0.5m/s; --force then gives a direction only.", metavar="V"),
    ] = None,
    seconds: Annotated[float, typer.Option(help="Length of the sound.", metavar="S")] = 3.0,
    rate: Annotated[float, typer.Option(help="Samples per second.", metavar="HZ")] = 44100.0,
    level: Annotated[
        str, typer.Option(help="Where gains come from: network, or table (the exact ones at its nodes).")
    ] = "network",
    distance: Annotated[
        str | None,
        typer.Option(
            help="Pressure that far from the object, as 0.5m; the bare modes if left out.", metavar="L"
        ),
    ] = None,
    full_scale: Annotated[
        float | None,
        typer.Option(
            help="Of the file, in the sound's unit, so that files compare; 1 dB above the loudest if left "
            "out.",
            metavar="X",
        ),
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(help="Spectrogram and mode shapes.", metavar="FILE.png")
    ] = None,
    json: options.Json = False,
) -> int:
    """What a strike at a place of an object sounds like.

    The gains of the place come from the object's network, the sound is the sum of its modes. Modes at or
    above half of the rate are left out, and said.

    Try: touchstone object render audio objects/bowl --vertex 0 --hammer nylon --out bowl.wav
    """
    from harness import api
    from harness.basics.errors import WrongUse
    from harness.basics.quantities import LENGTH, MASS, SPEED, TIME

    options.require_files(("--out", out, ".wav"), ("--picture", picture, ".png"))
    if impulse and (hammer is not None or contact_time is not None):
        raise WrongUse("--impulse takes no time, and --hammer and --contact-time do; say one or the other")
    rendered = api.render_audio(
        folder,
        at=None if at is None else places.point("--at", at),
        vertex=vertex,
        force=force,
        hammer_name=hammer,
        contact_time=options.quantity("--contact-time", contact_time, TIME),
        tip_radius=options.quantity("--tip-radius", tip_radius, LENGTH),
        hammer_mass=options.quantity("--hammer-mass", hammer_mass, MASS),
        speed=options.quantity("--speed", speed, SPEED),
        duration=seconds,
        rate=rate,
        level=level,
        distance=options.quantity("--distance", distance, LENGTH),
        out=out,
        full_scale=full_scale,
        picture=picture,
    )
    print_result(rendered, json)
    return 0
