"""``touchstone check``: open every instrument of a station and see how it does."""

import tempfile
import time
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape
from rich.table import Table

from harness.basics.errors import SafetyStop
from harness.commands import options
from harness.commands.output import ANSWERS, CONSOLE, emit


def check(
    station: options.Station = "mock",
    seconds: Annotated[float, typer.Option(help="How long to watch each stream.", min=0.5, max=600.0)] = 3.0,
    json: options.Json = False,
) -> int:
    """Open every instrument of a station: rate, drops, latency, level. Nothing moves, nothing is struck.

    Every instrument that does not open is named, with the cable to look at, beside those that do.

    Try: touchstone check --station mock
    """
    from harness.bench.station import RunContext, check_bench, open_station, scene_of_all
    from harness.bench.station_file import load_station, station_path
    from harness.effects.scene_object import known_object

    bench_file = load_station(station_path(station))
    scene = scene_of_all(bench_file)
    with tempfile.TemporaryDirectory(prefix="touchstone-check-") as folder:
        context = RunContext(Path(folder) / "truth.json", known_object(scene).mesh)
        with (
            CONSOLE.status(f"opening {bench_file.title or station}"),
            open_station(bench_file, scene, context, each=True) as bench,
        ):
            time.sleep(seconds)
            found = check_bench(bench)
    if json:
        emit({"schema": 1, "station": station, **found.as_json()})
    else:
        table = Table(title=f"{bench_file.title or station}: arm {found.safety or 'not open'}")
        for heading in ("instrument", "identity", "rate (Hz)", "drops", "latency (ms)", ""):
            table.add_column(heading)
        for health in found.instruments:
            latency = "not known" if health.latency is None else f"{1e3 * health.latency:.1f}"
            rate, drops = f"{health.rate:.1f}", str(health.drops)
            table.add_row(health.name, health.identity, rate, drops, latency, health.detail)
        ANSWERS.print(table)
        for name, error in found.failures.items():
            CONSOLE.print(f"[bold red]error:[/] {name}: {escape(str(error))}")
    unsafe = any(isinstance(error, SafetyStop) for error in found.failures.values())
    return SafetyStop.exit_code if unsafe else int(bool(found.failures))
