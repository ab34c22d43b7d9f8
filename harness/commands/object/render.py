"""``touchstone object render audio``: what a strike at a place of an object sounds like."""

import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from harness.commands import options, places
from harness.commands.object.render_answer import RenderedSound, as_json, draw, print_answer
from harness.commands.output import emit

if TYPE_CHECKING:
    from harness.objectfile.audio.audio import AudioLevel, ObjectAudio
    from harness.objectfile.audio.blow import HammerBlow
    from harness.objectfile.audio.strike import Place
    from harness.objectfile.file import ObjectFile

Three = tuple[float, float, float]

_ANY_TIP = "steel"
"""Whose mass a hammer has whose tip is given by its contact time."""

_FIRST = 3.0
"""s at most of the sound that is made before the one that is timed."""


@dataclass(frozen=True)
class _Pulse:
    """Options of what strikes, in SI units."""

    hammer: str | None
    contact_time: float | None
    tip_radius: float | None
    hammer_mass: float | None
    speed: float | None


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
    from harness.basics.quantities import LENGTH, MASS, SPEED, TIME
    from harness.objectfile.audio.sound_wav import wav_rate, write_wav

    _check(out, picture, impulse, hammer, contact_time)
    wav_rate(rate)
    given = _Pulse(
        hammer,
        options.quantity("--contact-time", contact_time, TIME),
        options.quantity("--tip-radius", tip_radius, LENGTH),
        options.quantity("--hammer-mass", hammer_mass, MASS),
        options.quantity("--speed", speed, SPEED),
    )
    far = options.quantity("--distance", distance, LENGTH)
    rendered = _rendered(folder, level, at, vertex, force, given, seconds, rate, far)
    scale = write_wav(out, rendered.made.sound, rate, full_scale)
    if picture is not None:
        draw(rendered, picture)
    if json:
        emit(as_json(rendered, out, scale, picture))
    else:
        print_answer(rendered, out, scale, picture)
    return 0


def _check(
    out: Path,
    picture: Path | None,
    impulse: bool,
    hammer: str | None,
    contact_time: str | None,
) -> None:
    from harness.basics.errors import WrongUse

    options.require_files(("--out", out, ".wav"), ("--picture", picture, ".png"))
    if impulse and (hammer is not None or contact_time is not None):
        raise WrongUse("--impulse takes no time, and --hammer and --contact-time do; say one or the other")


def _rendered(
    folder: Path,
    level: str,
    at: places.Coordinates | None,
    vertex: int | None,
    force: Three | None,
    given: _Pulse,
    duration: float,
    rate: float,
    distance: float | None,
) -> RenderedSound:
    from harness.objectfile.audio.audio import open_audio
    from harness.objectfile.audio.strike import strike
    from harness.objectfile.file import ObjectFile
    from harness.sim.sound.modal_radiation import radiation

    begun = time.perf_counter()
    of = ObjectFile.open(folder)
    audio = open_audio(of, _level(level))
    place = _place(audio, at, vertex)
    blow = _blow(of, audio.entry.mass_kg, place, force, given)
    # The first sound sorts the surface and loads the compiled loops for all that follow.
    strike(audio, place, blow, min(duration, _FIRST), rate)
    loaded = time.perf_counter() - begun
    begun = time.perf_counter()
    loudness = None if distance is None else radiation(audio.as_modes(), distance)
    heard = {} if distance is None else {"radiation": time.perf_counter() - begun}
    made = strike(audio, place, blow, duration, rate, loudness)
    seconds = {"load": loaded, **heard, **made.seconds}
    return RenderedSound(of, audio, place, blow, made, duration, distance, seconds)


def _level(text: str) -> "AudioLevel":
    from harness.basics.errors import WrongUse

    if text == "network":
        return "network"
    if text == "table":
        return "table"
    raise WrongUse(f"no level {text!r} of a sound; --level takes network, or table for the exact gains")


def _place(audio: "ObjectAudio", at: places.Coordinates | None, vertex: int | None) -> "Place":
    from harness.basics.errors import WrongUse
    from harness.objectfile.audio.strike import place_near, place_of_vertex

    if at is not None and vertex is None:
        return place_near(audio.surface, places.point("--at", at), audio.most)
    if vertex is not None and at is None:
        return place_of_vertex(audio.surface.mesh, vertex)
    raise WrongUse("say where it is struck: either --at X Y Z in metres, or --vertex N")


def _blow(of: "ObjectFile", mass: float, place: "Place", force: Three | None, given: _Pulse) -> "HammerBlow":
    from harness.basics.errors import WrongUse
    from harness.objectfile.audio.blow import HammerBlow, hammer, hammered

    along = -place.normal if force is None else force
    if given.hammer is None and given.contact_time is None:
        if any(value is not None for value in (given.tip_radius, given.hammer_mass, given.speed)):
            raise WrongUse("--tip-radius, --hammer-mass and --speed are a hammer's; say --hammer as well")
        return HammerBlow.instant(along)
    if given.contact_time is not None and given.tip_radius is not None:
        raise WrongUse("--contact-time stands for the tip, and --tip-radius is one; say one or the other")
    with_what = hammer(given.hammer or _ANY_TIP, given.tip_radius, given.hammer_mass)
    return hammered(along, with_what, of.material, mass, given.speed, given.contact_time)
