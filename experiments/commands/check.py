"""``touchstone check``: open every instrument of a station and see how it does."""

import tempfile
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from experiments.commands import options
from experiments.commands.output import ANSWERS, CONSOLE, emit


def check(
    station: options.Station = "mock",
    seconds: Annotated[float, typer.Option(help="How long to watch each stream.", min=0.5, max=600.0)] = 3.0,
    json: options.Json = False,
) -> int:
    """Open every instrument of a station: rate, drops, latency. Nothing moves.

    Every instrument that does not open is named, with the cable to look at.

    Try: touchstone check --station mock
    """
    from harness.scene import scene_from_options
    from harness.sim.scene_object import known_object
    from harness.station import RunContext, open_station
    from harness.station_file import load_station, station_path

    bench_file = load_station(station_path(station))
    scene = scene_from_options("builtin:mug")
    with tempfile.TemporaryDirectory(prefix="touchstone-check-") as folder:
        context = RunContext(Path(folder) / "truth.json", known_object(scene).mesh)
        with (
            CONSOLE.status(f"opening {bench_file.title or station}"),
            open_station(bench_file, scene, context) as bench,
        ):
            bench.pause(seconds)
            bench.gel.read(1, timeout=3.0)
            found = [bench.arm.health(), bench.gel.health()]
            safety = bench.arm.state().safety
    if json:
        emit({"schema": 1, "station": station, "safety": safety, "instruments": [asdict(h) for h in found]})
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
