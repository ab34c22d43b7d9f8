"""Recorded runs."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from harness.experiment.answer import common, score
from harness.experiment.experiment import AnyScored
from harness.experiment.levels import chosen_levels
from harness.experiment.lookup import experiment_of
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles


def answer(run: str | Path, levels: Sequence[str] = ()) -> dict[str, Any]:
    """Answer a recorded run; no bench is opened and nothing is written.

    Args:
        run: its folder.
        levels: dials turned from their defaults, ``"localization.method=particle"``.

    Returns:
        The result as ``result.json`` has it, without the report.

    Raises:
        WrongUse: no run, a calibration's run, or an unknown dial.
        RecordingDamaged: a step or a file of it is not what was recorded.
        FitRefused: nothing explains the readings.
    """
    files = RunFiles(Recording(Path(run)))
    experiment = experiment_of(files.recording)
    accuracy = chosen_levels(experiment.knobs, levels, files.network_levels)
    scored: AnyScored = score(experiment, files, accuracy)
    return {**common(experiment, scored), **scored.result}
