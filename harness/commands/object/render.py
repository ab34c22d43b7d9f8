"""``touchstone object render audio``: what a strike at a place of an object sounds like."""

import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from harness.commands import options, places
from harness.commands.output import ANSWERS, emit, warn

if TYPE_CHECKING:
    from harness.objectfile.audio.audio import ObjectAudio
    from harness.objectfile.audio.blow import HammerBlow
    from harness.objectfile.audio.strike import Place, StruckSound
    from harness.objectfile.file import ObjectFile


Three = tuple[float, float, float]


_ANY_TIP = "steel"
"""Whose mass a hammer has whose tip is given by its contact time."""


_FIRST = 3.0
"""s at most of the sound that is made before the one that is timed."""


@dataclass(frozen=True, eq=False)
class RenderedSound:
    """A sound, and all that is said of it."""

    of: "ObjectFile"  #: the object.
    audio: "ObjectAudio"  #: its sound at a level.
    place: "Place"  #: that was struck.
    blow: "HammerBlow"  #: that struck it.
    made: "StruckSound"  #: the sound.
    duration: float  #: s.
    distance: float | None  #: m, at which it is a pressure; None for the bare modes.
    seconds: dict[str, float]  #: s on the clock by stage.


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
    from harness.basics.errors import WrongUse
    from harness.basics.quantities import LENGTH, MASS, SPEED, TIME
    from harness.objectfile.audio.sound_wav import wav_rate, write_wav

    options.require_files(("--out", out, ".wav"), ("--picture", picture, ".png"))
    if impulse and (hammer is not None or contact_time is not None):
        raise WrongUse("--impulse takes no time, and --hammer and --contact-time do; say one or the other")
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
    from harness.basics.errors import WrongUse
    from harness.objectfile.audio.audio import open_audio
    from harness.objectfile.audio.strike import place_near, place_of_vertex, strike
    from harness.objectfile.file import ObjectFile
    from harness.sim.sound.modal_radiation import radiation

    begun = time.perf_counter()
    of = ObjectFile.open(folder)
    if level not in ("network", "table"):
        raise WrongUse(f"no level {level!r} of a sound; --level takes network, or table for the exact gains")
    audio = open_audio(of, "network" if level == "network" else "table")
    if at is not None and vertex is None:
        place = place_near(audio.surface, places.point("--at", at), audio.most)
    elif vertex is not None and at is None:
        place = place_of_vertex(audio.surface.mesh, vertex)
    else:
        raise WrongUse("say where it is struck: either --at X Y Z in metres, or --vertex N")
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


_LISTED = 8


def draw(rendered: RenderedSound, path: Path) -> None:
    """Write the picture; it counts among the seconds."""
    from harness.objectfile.audio.strike import pushes
    from harness.report.figures.figures import Album
    from harness.report.figures.sound import SHOWN, ShownStrike, colourable, strike_figure

    begun = time.perf_counter()
    made, audio, place = rendered.made, rendered.audio, rendered.place
    heard = ~made.left_out
    mesh = colourable(audio.surface.mesh)
    shown = ShownStrike(
        title=_title(rendered),
        mesh=mesh,
        place=place.point,
        sound=made.sound,
        rate=made.rate,
        frequencies=audio.frequencies[heard],
        dampings=audio.dampings[heard],
        amplitudes=made.amplitudes[heard],
        pushes=pushes(audio, mesh, min(SHOWN, int(heard.sum()))),
    )
    Album(path.parent).photograph(path.stem, strike_figure(shown))
    rendered.seconds["picture"] = time.perf_counter() - begun


def _unit(rendered: RenderedSound) -> str:
    return "sqrt(kg) m/s" if rendered.distance is None else "Pa"


def _title(rendered: RenderedSound) -> str:
    description = rendered.of.description
    x, y, z = (round(1e3 * float(value), 1) + 0.0 for value in rendered.place.point)
    said, pulse = f"an impulse of {rendered.blow.impulse:.3g} N s", rendered.blow.pulse
    if pulse is not None:
        said = f"at most {pulse.peak:.3g} N over {1e3 * pulse.duration:.3g} ms"
    return (
        f"{description.name}, {description.material.name}, struck at ({x:.1f}, {y:.1f}, {z:.1f}) mm: "
        f"{said}; gains from the {rendered.audio.level}"
    )


def as_json(rendered: RenderedSound, out: Path, full_scale: float, picture: Path | None) -> dict[str, Any]:
    """As scripts read it."""
    from harness.objectfile.audio.sound_wav import BITS

    made, audio, place, blow = rendered.made, rendered.audio, rendered.place, rendered.blow
    heard = ~made.left_out
    level = audio.entry.network if audio.level == "network" else audio.entry.table
    pulse = blow.pulse
    return {
        "schema": 1,
        "folder": str(rendered.of.folder),
        "object": rendered.of.description.name,
        "level": audio.level,
        "point_m": place.point.tolist(),
        "normal": place.normal.tolist(),
        "vertex": place.vertex,
        "moved_m": place.moved,
        "force_direction": blow.direction.tolist(),
        "impulse_ns": blow.impulse,
        "peak_force_n": None if pulse is None else pulse.peak,
        "contact_s": None if pulse is None else pulse.duration,
        "duration_s": rendered.duration,
        "rate_hz": made.rate,
        "samples": len(made.sound),
        "distance_m": rendered.distance,
        "unit": _unit(rendered),
        "peak": made.peak,
        "modes": int(heard.sum()),
        "frequencies_hz": audio.frequencies[heard].tolist(),
        "dampings_per_s": audio.dampings[heard].tolist(),
        "gains_per_sqrt_kg": made.gains[heard].tolist(),
        "amplitudes": made.amplitudes[heard].tolist(),
        "left_out_hz": audio.frequencies[made.left_out].tolist(),
        "error_estimate": {
            "synthesis_db": made.error,
            "gains_measured": {} if level is None else dict(level.measured),
        },
        "wav": {"file": str(out), "bits": BITS, "full_scale": full_scale, "unit": _unit(rendered)},
        "picture": None if picture is None else str(picture),
        "seconds": rendered.seconds,
    }


def print_answer(rendered: RenderedSound, out: Path, full_scale: float, picture: Path | None) -> None:
    """For people."""
    import numpy as np

    from harness.objectfile.audio.sound_wav import BITS

    made, audio = rendered.made, rendered.audio
    ANSWERS.print(_title(rendered), markup=False)
    if rendered.place.moved > 0.0:
        ANSWERS.print(f"moved by {rendered.place.moved * 1e3:.3g} mm onto the surface")
    heard = ~made.left_out
    strongest = np.flatnonzero(heard)[np.argsort(-np.abs(made.amplitudes[heard]))][:_LISTED]
    listed = ", ".join(f"{audio.frequencies[mode]:.5g}" for mode in np.sort(strongest))
    ANSWERS.print(
        f"{int(heard.sum())} modes; the loudest {len(strongest)}: {listed} Hz; peak {made.peak:.4g} "
        f"{_unit(rendered)}, summed to {made.error:.0f} dB"
    )
    if made.left_out.any():
        low = float(audio.frequencies[made.left_out].min())
        warn(
            f"{int(made.left_out.sum())} modes from {low:.5g} Hz up are left out, at or above half of "
            f"{made.rate:g} samples per second"
        )
    ANSWERS.print(
        f"{out}: {rendered.duration:g} s at {made.rate:g} Hz, {BITS} bits, full scale {full_scale:.4g} "
        f"{_unit(rendered)}",
        markup=False,
    )
    if picture is not None:
        ANSWERS.print(str(picture), markup=False)
    took = ", ".join(f"{stage} {1e3 * seconds:.1f} ms" for stage, seconds in rendered.seconds.items())
    ANSWERS.print(took, markup=False)
