"""``touchstone compare``: a recording against an ObjectFile, the reference simulation and the twin."""

from pathlib import Path
from typing import Annotated

import typer

from harness.commands import options


def compare(
    run: options.RunFolder,
    objectfile: Annotated[
        Path | None,
        typer.Option(
            "--objectfile",
            help="ObjectFile of another object to compare with instead of the run's own: its folder, or "
            "the name of one that comes with the program.",
            metavar="FOLDER",
            callback=options.find_objectfile,
        ),
    ] = None,
    reference: Annotated[
        bool,
        typer.Option("--reference", help="Compare with the reference simulation too, beside the networks."),
    ] = False,
    json: options.Json = False,
) -> int:
    """Hold a run's readings against a model of its object; no bench is opened, and no answer is needed.

    The model stands where the scene says. For each sense it prints one verdict: fits, does not fit, or not
    comparable and why. A reading does not fit where it is farther from the model than the stated errors of
    place, tool, gel and sound allow; a right model is refused in one run of a hundred.

    To try: touchstone compare runs/... --objectfile objects/bowl
    """
    from harness.agreement.compare_run import agreement_of
    from harness.agreement.subject import own_subject, subject_of_file
    from harness.commands.output import ANSWERS, emit
    from harness.experiment.answer import levels_of_result
    from harness.experiment.lookup import experiment_of
    from harness.recording.recording import Recording
    from harness.recording.run_folder import RunFiles

    files = RunFiles(Recording(run))
    kind = experiment_of(files.recording)
    if objectfile is None:
        subject = own_subject(files, levels_of_result(kind, run))
        found = agreement_of(files, subject, reference, kind.measured)
    else:
        found = agreement_of(files, subject_of_file(files, objectfile), reference)
    if json:
        emit({"schema": 1, "recording": str(run), **found.as_json()})
        return 0
    ANSWERS.print(f"{run} against {found.about}", markup=False)
    for line in found.lines():
        ANSWERS.print(f"  {line}", markup=False)
    doubt = found.first_doubt
    if doubt is not None:
        ANSWERS.print(f"first in doubt: {doubt[1]} at step {doubt[0] + 1}", markup=False)
    return 0
