"""``touchstone check``: open every instrument of a station and see how it does."""

import math
import tempfile
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from harness.basics.errors import BenchFault
from harness.bench.device import Health
from harness.commands import options
from harness.commands.output import ANSWERS, CONSOLE, emit

if TYPE_CHECKING:
    from harness.bench.station import Bench

_LISTEN = 0.5
"""s."""

_ATTEMPTS = 3
"""Times that is listened where samples of the sound were lost: a computer may be busy for a moment."""

_HEARING = 20e-6
"""Pa, the reference of sound pressure levels (ISO 1683)."""


def check(
    station: options.Station = "mock",
    seconds: Annotated[float, typer.Option(help="How long to watch each stream.", min=0.5, max=600.0)] = 3.0,
    json: options.Json = False,
) -> int:
    """Open every instrument of a station: rate, drops, latency, level. Nothing moves, nothing is struck.

    Every instrument that does not open is named, with the cable to look at.

    Try: touchstone check --station mock
    """
    from harness.bench.scene import scene_from_options
    from harness.bench.station import RunContext, open_station
    from harness.bench.station_file import load_station, station_path
    from harness.effects.scene_object import known_object

    bench_file = load_station(station_path(station))
    scene = scene_from_options("builtin:mug")
    heard = scene.sensors.model_copy(update={"sound": bench_file.hammer is not None})
    scene = scene.model_copy(update={"sensors": heard})
    with tempfile.TemporaryDirectory(prefix="touchstone-check-") as folder:
        context = RunContext(Path(folder) / "truth.json", known_object(scene).mesh)
        with (
            CONSOLE.status(f"opening {bench_file.title or station}"),
            open_station(bench_file, scene, context) as bench,
        ):
            bench.pause(seconds)
            bench.gel.read(1, timeout=3.0)
            found = [bench.arm.health(), bench.gel.health()]
            levels = None if bench.hammer is None else rest_levels(bench)
            if bench.hammer is not None and levels is not None:
                found += _heard(bench, levels)
            safety = bench.arm.state().safety
    if json:
        instruments = [asdict(health) for health in found]
        said = {"schema": 1, "station": station, "safety": safety, "instruments": instruments}
        emit({**said, "hammer_levels": None if levels is None else asdict(levels)})
        return 0
    table = Table(title=f"{bench_file.title or station}: arm {safety}")
    for heading in ("instrument", "identity", "rate (Hz)", "drops", "latency (ms)", ""):
        table.add_column(heading)
    for health in found:
        latency = "not known" if health.latency is None else f"{1e3 * health.latency:.1f}"
        table.add_row(
            health.name, health.identity, f"{health.rate:.1f}", str(health.drops), latency, health.detail
        )
    ANSWERS.print(table)
    return 0


@dataclass(frozen=True)
class RestLevels:
    """What the hammer's box reads while nothing is struck.

    Attributes:
        force_rms_n: N, about its mean.
        pressure_rms_pa: Pa, about its mean.
        sound_level_db: of the pressure, over 20 uPa.
    """

    force_rms_n: float
    pressure_rms_pa: float
    sound_level_db: float


def rest_levels(bench: "Bench") -> RestLevels:
    """Listen for a moment with nothing fired.

    Raises:
        BenchFault: the box failed.
        DataRefused: a channel rests where its calibration says that it cannot.
    """
    from harness.bench.acquisition import strike_from_readings
    from harness.bench.listening import capture

    assert bench.hammer is not None
    assert bench.station.hammer is not None
    for _ in range(_ATTEMPTS):
        readings = capture(bench.hammer, bench.microphone, lambda: None, 0.0, _LISTEN, 0.0)
        by_name = {reading.channel.name: reading for reading in readings}
        rest = strike_from_readings(by_name, bench.station.hammer.acquisition)
        if not rest.lost:
            break
    else:
        raise BenchFault(f"the microphone cannot be used: {rest.lost}; close what else runs, or try again")
    pressure = float(rest.pressure.std())
    # A converter that reads one count for ever is broken, not silent.
    level = 20.0 * math.log10(pressure / _HEARING) if pressure > 0.0 else -math.inf
    if not math.isfinite(level):
        raise BenchFault("the microphone reads the same count for ever; check its cable and its supply")
    return RestLevels(float(rest.force.std()), pressure, level)


def _heard(bench: "Bench", levels: RestLevels) -> list[Health]:
    """How the hammer does and, where it has an instrument of its own, the microphone; each with its level."""
    assert bench.hammer is not None
    force, sound = f"{levels.force_rms_n:.3f} N rms", f"{levels.sound_level_db:.0f} dB SPL"
    if bench.microphone is None:
        return [_with_level(bench.hammer.health(), f"{force}, {sound}")]
    return [_with_level(bench.hammer.health(), force), _with_level(bench.microphone.health(), sound)]


def _with_level(health: Health, level: str) -> Health:
    said = f"rest {level}"
    return replace(health, detail=f"{said}; {health.detail}" if health.detail else said)
