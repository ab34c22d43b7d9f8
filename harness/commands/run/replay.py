"""``touchstone replay``: estimate again from a recording alone."""

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from harness.commands import options
from harness.commands.output import warn


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
    from harness.basics.errors import RecordingDamaged
    from harness.basics.files.lock_file import hold_folder
    from harness.commands.run.planned_run import publisher, show_report
    from harness.experiment.answer import finish, levels_of_result
    from harness.experiment.levels import chosen_levels
    from harness.experiment.lookup import experiment_of
    from harness.recording.recording import Recording
    from harness.recording.run_folder import RunFiles
    from harness.recording.wav_export import export_wav
    from harness.report.run_page import write_run_page

    files = RunFiles(Recording(run))
    recording = files.recording
    kind = experiment_of(recording)
    if wav is not None:
        written = export_wav(recording, wav)
        warn(f"{len(written)} WAV files in {wav}; counts, rates and times in wav.json beside them")
    try:
        own = levels_of_result(kind, recording.folder) or files.network_levels
    except RecordingDamaged as error:
        own = files.network_levels
        warn(f"{error}; the default levels are taken")
    accuracy = chosen_levels(kind.knobs, level or [], own)
    folder = out or run.with_name(f"{run.name}-replay")
    draw = partial(write_run_page, kind)
    with hold_folder(folder):
        result = finish(kind, files, accuracy, draw, None, folder, None, publisher(kind, json))
    show_report(result, json)
    return 0
