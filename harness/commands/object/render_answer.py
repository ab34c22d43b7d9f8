"""What ``touchstone object render audio`` answers: a picture, one JSON object, or lines for people."""

import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from harness.commands.output import ANSWERS, warn

if TYPE_CHECKING:
    from harness.objectfile.audio.audio import ObjectAudio
    from harness.objectfile.audio.blow import HammerBlow
    from harness.objectfile.audio.strike import Place, StruckSound
    from harness.objectfile.file import ObjectFile

_LISTED = 8


@dataclass(frozen=True, eq=False)
class RenderedSound:
    """A sound, and all that is said of it.

    Attributes:
        of: the object.
        audio: its sound at a level.
        place: that was struck.
        blow: that struck it.
        made: the sound.
        duration: s.
        distance: m, at which it is a pressure; None for the bare modes.
        seconds: s on the clock by stage.
    """

    of: "ObjectFile"
    audio: "ObjectAudio"
    place: "Place"
    blow: "HammerBlow"
    made: "StruckSound"
    duration: float
    distance: float | None
    seconds: dict[str, float]


def draw(rendered: RenderedSound, path: Path) -> None:
    """Write the picture; it counts among the seconds."""
    from harness.objectfile.audio.strike import pushes
    from harness.report.figures.figures import Album
    from harness.report.figures.mode_pictures import SHOWN, ShownStrike, colourable, strike_figure

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


def _blow_said(blow: "HammerBlow") -> str:
    if blow.pulse is None:
        return f"an impulse of {blow.impulse:.3g} N s"
    return f"at most {blow.pulse.peak:.3g} N over {1e3 * blow.pulse.duration:.3g} ms"


def _title(rendered: RenderedSound) -> str:
    description = rendered.of.description
    x, y, z = (round(1e3 * float(value), 1) + 0.0 for value in rendered.place.point)
    return (
        f"{description.name}, {description.material.name}, struck at ({x:.1f}, {y:.1f}, {z:.1f}) mm: "
        f"{_blow_said(rendered.blow)}; gains from the {rendered.audio.level}"
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
