"""``touchstone replay``: estimate again from a recording alone."""

from pathlib import Path
from typing import Annotated

import typer

from harness.commands import options
from harness.commands.output import print_result


def replay(
    run: options.RunFolder,
    level: options.LevelOption = None,
    out: Annotated[
        Path | None, typer.Option(help="Where the result and the report go; beside the run if left out.")
    ] = None,
    wav: Annotated[
        Path | None,
        typer.Option(
            help="Also write the force and sound of every strike there, as WAV files.", metavar="FOLDER"
        ),
    ] = None,
    json: options.Json = False,
) -> int:
    """Estimate again from a recording alone; no bench is opened.

    It takes the levels that the run's own result was found at, and gives the same numbers to the bit;
    --level turns one of them, which trades accuracy for time on the same readings.

    Try: touchstone replay runs/... --level localization.method=particle
    """
    options.require_folders(("--out", out), ("--wav", wav))
    from harness import api
    from harness.commands.run.watcher import TerminalWatcher

    print_result(api.replay(run, level or (), out, wav, TerminalWatcher(json)), json)
    return 0
