"""``touchstone replay``: estimate again from a recording alone."""

from pathlib import Path
from typing import Annotated

import typer

from experiments.commands.run import show
from harness import options
from harness.output import CONSOLE, warn


def replay(
    run: Annotated[Path, typer.Argument(help="A run folder, as runs/20260101-120000-...", metavar="RUN")],
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

    At the same levels the numbers are the same to the bit. Other levels trade accuracy for time on the
    same readings.

    Try: touchstone replay runs/... --level localization.method=particle
    """
    from experiments.contact_localization import session_of
    from experiments.contact_localization.dials import chosen
    from harness.recording import Recording
    from harness.wav_export import export_wav

    recording = Recording(run)
    if wav is not None:
        files = export_wav(recording, wav)
        warn(f"{len(files)} WAV files in {wav}; counts, rates and times in wav.json beside them")
    folder = out or run.with_name(f"{run.name}-replay")
    folder.mkdir(parents=True, exist_ok=True)
    with CONSOLE.status("estimating from the recording"):
        result = session_of.finish(recording, chosen(level or []), None, folder)
    show(result, json)
    return 0
