"""The sound of a strike on an object with an ObjectFile, as ``touchstone object render audio`` gives it."""

import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.errors import WrongUse
from harness.basics.result import HIDDEN, JSON_ONLY, Result
from harness.bench.scene_objectfile import find_objectfile
from harness.objectfile.audio.audio import ObjectAudio, open_audio
from harness.objectfile.audio.blow import HammerBlow, hammer, hammered
from harness.objectfile.audio.sound_wav import BITS, wav_rate, write_wav
from harness.objectfile.audio.strike import Place, StruckSound, place_near, place_of_vertex, pushes, strike
from harness.objectfile.file import ObjectFile
from harness.sim.sound.modal_sound import radiation

Three = tuple[float, float, float]

_MASS_OF_TIP = "steel"
"""Hammer whose mass is used if only a contact time is given."""

_WARM_UP = 3.0
"""Longest sound in s that is computed before the timed one, to load compiled loops and sort the surface."""

_LISTED = 8
"""Loudest modes that the summary lists."""


@dataclass(frozen=True)
class RenderedWav:
    """The WAV file of a sound."""

    file: Path
    bits: int
    full_scale: float  #: value of a sample of full scale, in ``unit``.
    unit: str


@dataclass(frozen=True)
class AudioError:
    """Errors of a rendered sound."""

    synthesis_db: float  #: of the sum of the modes, against the peak of the sound.
    gains_measured: Mapping[str, float]  #: of the gains, as measured when the ObjectFile was built.


@dataclass(frozen=True, eq=False)
class RenderedAudio(Result):
    """The sound of a strike, with the modes that it is the sum of."""

    folder: Path  #: of the ObjectFile.
    object: str  #: name of the object.
    level: str  #: source of the gains: ``"network"`` or ``"table"``.
    point_m: FloatArray = field(metadata=JSON_ONLY)  #: ``(3,)`` struck point in the object's frame.
    normal: FloatArray = field(metadata=JSON_ONLY)  #: ``(3,)`` outward.
    vertex: int | None  #: of the mesh, if the point was given by its number.
    moved_m: float  #: distance from the given point to the surface.
    force_direction: FloatArray = field(metadata=JSON_ONLY)  #: ``(3,)`` of unit length.
    impulse_ns: float
    peak_force_n: float | None  #: None for an impulse.
    contact_s: float | None  #: duration of the contact; None for an impulse.
    duration_s: float
    rate_hz: float  #: samples per second.
    samples: int
    distance_m: float | None  #: of the microphone; None for the bare sum of modes.
    unit: str  #: of ``sound``.
    peak: float  #: largest absolute sample.
    modes: int  #: below half of the rate.
    frequencies_hz: FloatArray = field(metadata=JSON_ONLY)  #: ``(modes,)``.
    dampings_per_s: FloatArray = field(metadata=JSON_ONLY)  #: ``(modes,)`` decay rates.
    gains_per_sqrt_kg: FloatArray = field(metadata=JSON_ONLY)  #: ``(modes,)`` along the force.
    amplitudes: FloatArray = field(metadata=JSON_ONLY)  #: ``(modes,)`` in ``unit``.
    left_out_hz: FloatArray = field(metadata=JSON_ONLY)  #: modes at or above half of the rate.
    error_estimate: AudioError
    wav: RenderedWav | None  #: None if no file was written.
    picture: Path | None  #: spectrogram and mode shapes; None if not drawn.
    seconds: Mapping[str, float]  #: wall time by stage.
    notes: tuple[str, ...] = field(metadata=JSON_ONLY)
    title: str = field(metadata=HIDDEN)  #: object, struck point, force and source of the gains.
    sound: FloatArray = field(metadata=HIDDEN)  #: ``(samples,)``.

    def summary(self) -> tuple[str, ...]:
        """State what was struck and the loudest modes."""
        loudest = np.sort(np.argsort(-np.abs(self.amplitudes))[:_LISTED])
        listed = ", ".join(f"{frequency:.5g}" for frequency in self.frequencies_hz[loudest])
        return (
            self.title,
            f"{self.modes} modes; the loudest {len(loudest)}: {listed} Hz",
        )


def render_audio(
    folder: str | Path,
    at: Three | None = None,
    vertex: int | None = None,
    force: Three | None = None,
    hammer_name: str | None = None,
    contact_time: float | None = None,
    tip_radius: float | None = None,
    hammer_mass: float | None = None,
    speed: float | None = None,
    duration: float = 3.0,
    rate: float = 44100.0,
    level: str = "network",
    distance: float | None = None,
    out: Path | None = None,
    full_scale: float | None = None,
    picture: Path | None = None,
) -> RenderedAudio:
    """Render the sound of a strike from an object's network of gains.

    Args:
        folder: of the ObjectFile, or its name.
        at: struck point in m, in the object's frame; or give ``vertex``.
        vertex: number of the struck vertex of the ObjectFile's mesh, counted from 0.
        force: on the object: impulse in N s, or peak force in N if a hammer is given; one inward if None.
        hammer_name: ``"steel"``, ``"nylon"`` or ``"rubber"`` for a round tip by Hertz's law; None for an
            impulse, unless ``contact_time`` is given.
        contact_time: duration of the contact in s, which decides the stiffness of the tip.
        tip_radius: radius of the hammer's tip in m; the hammer's own if None.
        hammer_mass: mass of the hammer in kg; the hammer's own if None.
        speed: speed of the hammer in m/s; ``force`` is then a direction only.
        duration: length of the sound in s.
        rate: samples per second; modes at or above half of it are left out and listed.
        level: source of the gains, ``"network"`` or ``"table"``, which has the exact ones at its nodes.
        distance: of the microphone in m, so that the sound is a pressure; None for the bare sum of modes.
        out: WAV file to write, 24 bits.
        full_scale: value of a sample of full scale in the file; 1 dB above the loudest sample if None.
        picture: PNG file to write, with the spectrogram and the shapes of the lowest modes.

    Raises:
        WrongUse: options that conflict, or a value out of range.
        OutOfDomain: the point is off the surface.
        DataRefused: the ObjectFile has no sound, or a file of it is damaged.
    """
    if level not in ("network", "table"):
        raise WrongUse(f"no level {level!r} of a sound; --level takes network, or table for the exact gains")
    if out is not None:
        wav_rate(rate)
    begun = time.perf_counter()
    objectfile = ObjectFile.open(find_objectfile(folder))
    audio = open_audio(objectfile, "network" if level == "network" else "table")
    if at is not None and vertex is None:
        place = place_near(audio.surface, at, audio.most)
    elif vertex is not None and at is None:
        place = place_of_vertex(audio.surface.mesh, vertex)
    else:
        raise WrongUse("give the struck point: either --at X Y Z in metres, or --vertex N")
    along = -place.normal if force is None else np.asarray(force, dtype=np.float64)
    if hammer_name is None and contact_time is None:
        if any(value is not None for value in (tip_radius, hammer_mass, speed)):
            raise WrongUse("--tip-radius, --hammer-mass and --speed are a hammer's; say --hammer as well")
        blow = HammerBlow.instant(along)
    elif contact_time is not None and tip_radius is not None:
        raise WrongUse("--contact-time stands for the tip, and --tip-radius is one; say one or the other")
    else:
        tip = hammer(hammer_name or _MASS_OF_TIP, tip_radius, hammer_mass)
        blow = hammered(along, tip, objectfile.material, audio.entry.mass_kg, speed, contact_time)
    strike(audio, place, blow, min(duration, _WARM_UP), rate)
    seconds = {"load": time.perf_counter() - begun}
    loudness = None
    if distance is not None:
        begun = time.perf_counter()
        loudness = radiation(audio.as_modes(), distance)
        seconds["radiation"] = time.perf_counter() - begun
    made = strike(audio, place, blow, duration, rate, loudness)
    seconds |= made.seconds
    audible, measured = ~made.left_out, audio.entry.network if level == "network" else audio.entry.table
    unit = "sqrt(kg) m/s" if distance is None else "Pa"
    description, pulse = objectfile.description, blow.pulse
    struck = _strike_in_words(place, blow)
    title = f"{description.name}, {description.material.name}, {struck}; gains from the {level}"
    wav = None
    if out is not None:
        wav = RenderedWav(out, BITS, write_wav(out, made.sound, rate, full_scale), unit)
    if picture is not None:
        begun = time.perf_counter()
        _draw(audio, place, made, title, picture)
        seconds["picture"] = time.perf_counter() - begun
    left_out = audio.frequencies[made.left_out]
    return RenderedAudio(
        folder=objectfile.folder,
        object=description.name,
        level=level,
        point_m=place.point,
        normal=place.normal,
        vertex=place.vertex,
        moved_m=place.moved,
        force_direction=blow.direction,
        impulse_ns=blow.impulse,
        peak_force_n=None if pulse is None else pulse.peak,
        contact_s=None if pulse is None else pulse.duration,
        duration_s=duration,
        rate_hz=made.rate,
        samples=len(made.sound),
        distance_m=distance,
        unit=unit,
        peak=made.peak,
        modes=int(audible.sum()),
        frequencies_hz=audio.frequencies[audible],
        dampings_per_s=audio.dampings[audible],
        gains_per_sqrt_kg=made.gains[audible],
        amplitudes=made.amplitudes[audible],
        left_out_hz=left_out,
        error_estimate=AudioError(made.error, {} if measured is None else measured.measured),
        wav=wav,
        picture=picture,
        seconds=seconds,
        notes=_notes(left_out, rate),
        title=title,
        sound=made.sound,
    )


def _notes(left_out: FloatArray, rate: float) -> tuple[str, ...]:
    if not len(left_out):
        return ()
    return (
        f"{len(left_out)} modes from {left_out.min():.5g} Hz up are left out, at or above half of {rate:g} "
        "samples per second",
    )


def _strike_in_words(place: Place, blow: HammerBlow) -> str:
    x, y, z = (round(1e3 * float(value), 1) + 0.0 for value in place.point)
    force = f"an impulse of {blow.impulse:.3g} N s"
    if blow.pulse is not None:
        force = f"at most {blow.pulse.peak:.3g} N over {1e3 * blow.pulse.duration:.3g} ms"
    return f"struck at ({x:.1f}, {y:.1f}, {z:.1f}) mm: {force}"


def _draw(audio: ObjectAudio, place: Place, made: StruckSound, title: str, path: Path) -> None:
    # Plotting takes a second to import.
    from harness.report.figures.figures import Album
    from harness.report.figures.sound import SHOWN, ShownStrike, colourable, strike_figure

    audible, mesh = ~made.left_out, colourable(audio.surface.mesh)
    shown = ShownStrike(
        title=title,
        mesh=mesh,
        place=place.point,
        sound=made.sound,
        rate=made.rate,
        frequencies=audio.frequencies[audible],
        dampings=audio.dampings[audible],
        amplitudes=made.amplitudes[audible],
        pushes=pushes(audio, mesh, min(SHOWN, int(audible.sum()))),
    )
    Album(path.parent).photograph(path.stem, strike_figure(shown))
