"""``touchstone check``: open every instrument of a station and see how it does."""

from typing import Annotated

import typer
from rich.markup import escape

from harness.commands import options
from harness.commands.output import CONSOLE, print_result


def check(
    station: options.Station = "mock",
    seconds: Annotated[float, typer.Option(help="How long to watch each stream.", min=0.5, max=600.0)] = 3.0,
    json: options.Json = False,
) -> int:
    """Open every instrument of a station: rate, drops, latency, level. Nothing moves, nothing is struck.

    Every instrument that does not open is named, with the cable to look at, beside those that do.

    Try: touchstone check --station mock
    """
    from harness import api

    with CONSOLE.status(f"opening {station}"):
        checked = api.check_station(station, seconds)
    print_result(checked, json)
    for name, failure in checked.failures.items():
        CONSOLE.print(f"[bold red]error:[/] {name}: {escape(failure)}")
    return checked.exit_code
