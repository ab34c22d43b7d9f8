"""From a recording to its result: answer, write ``result.json``, publish; only then compare and draw."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Generic, TypeVar

from harness.agreement.compare_run import agreement_of
from harness.agreement.subject import own_subject
from harness.basics.clock import now
from harness.basics.errors import RecordingDamaged, WrongUse
from harness.basics.files.foreign_file import MOST_JSON, read_bounded
from harness.basics.files.json_file import JsonObject
from harness.basics.npz_file import write_arrays
from harness.basics.whole_file import write_text_whole
from harness.bench.device import Health
from harness.effects.accuracy import Accuracy, Level, current_levels
from harness.effects.explain import as_json, scene_plan
from harness.experiment.compare import Comparison, compare
from harness.experiment.experiment import (
    Answer_co,
    Answering,
    AnyExperiment,
    AnyScored,
    Experiment,
    Readings_co,
    Scored,
)
from harness.experiment.truth import truth_or_notes
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles

SCHEMA = 1
RESULT = "result.json"
"""In a run's folder, and in that of a replay."""

OBSERVED = "observed.npz"
"""Beside it: what the scene observes, simulated at the answer."""

Publish = Callable[[JsonObject], None]
Draw = Callable[[AnyScored, Comparison, Mapping[str, Health] | None, Path], Path]
"""Writes the page of a scored run and its pictures into a folder; returns the path of the page."""


R = TypeVar("R", bound=Answering)
A = TypeVar("A")


def score(
    experiment: Experiment[R, A],
    run: RunFiles,
    accuracy: Accuracy,
    answering: R | None = None,
    folder: Path | None = None,
) -> Scored[R, A]:
    """Compute the answer, and compare it with the truth if that is known.

    Args:
        experiment: experiment of the run.
        run: folder of the run.
        accuracy: levels of the answer.
        answering: estimator with the readings; None to read them from the folder.
        folder: folder of ``result.json``; None to write none.

    Raises:
        WrongUse: the run has no step yet.
        FitRefused: nothing explains the readings.
    """
    recording = run.recording
    require_steps(experiment, recording)
    if answering is None:
        answering = experiment.answering(run, accuracy)
        for record in recording.steps():
            answering.read(record)
    found = experiment.estimate(answering)
    truth, notes = truth_or_notes(recording)
    warnings = (*recording.header.plan.get("warnings", ()), *recording.order_notes(), *notes)
    scored = Scored(run, answering, found, truth, accuracy, warnings, folder=folder)
    return replace(scored, result=experiment.result(scored))


def require_steps(experiment: AnyExperiment, recording: Recording) -> None:
    """Refuse a run of which nothing was performed: ``WrongUse``."""
    if recording.committed == 0:
        raise WrongUse(
            f"{recording.folder} holds no {experiment.step} yet; go on with `touchstone run --resume`"
        )


def finish(
    experiment: AnyExperiment,
    run: RunFiles,
    accuracy: Accuracy,
    draw: Draw,
    health: Mapping[str, Health] | None = None,
    folder: Path | None = None,
    answering: Answering | None = None,
    publish: Publish = lambda _: None,
    more: JsonObject | None = None,
    since: float | None = None,
) -> JsonObject:
    """Write and publish the result of a run, then write it again with the keys that the report adds.

    Args:
        experiment: experiment of the run.
        run: folder of the run.
        accuracy: levels of the answer and of the simulation.
        draw: function that writes the report.
        health: health of the instruments; None for a replay.
        folder: folder of result and report; the run's own if None.
        answering: estimator with the readings.
        publish: function that receives the result before the report is rendered.
        more: further keys of the result.
        since: time in s on the bench clock at which the last step was on the disk.
    """
    folder = folder or run.recording.folder
    written = write_answer(experiment, run, accuracy, folder, answering, publish, more, since)
    return add_report(experiment, written, draw, health, folder)


@dataclass(frozen=True, eq=False)
class WrittenAnswer(Generic[Readings_co, Answer_co]):
    """An answer that is written and published, and not yet compared."""

    scored: Scored[Readings_co, Answer_co]  #: the answer.
    result: JsonObject  #: as it was written.


def write_answer(
    experiment: Experiment[R, A],
    run: RunFiles,
    accuracy: Accuracy,
    folder: Path,
    answering: R | None = None,
    publish: Publish = lambda _: None,
    more: JsonObject | None = None,
    since: float | None = None,
) -> WrittenAnswer[R, A]:
    """Answer, write ``result.json``, publish; the arguments are ``finish``'s."""
    scored = score(experiment, run, accuracy, answering, folder)
    result = {**common(experiment, scored), **scored.result, **(more or {})}
    result["warnings"] = [*scored.warnings, *result.get("warnings", ())]
    result["answered_after_s"] = None if since is None else now() - since
    _write(folder / RESULT, result)
    publish(result)
    return WrittenAnswer(scored, result)


def add_report(
    experiment: AnyExperiment,
    written: WrittenAnswer[Answering, object],
    draw: Draw,
    health: Mapping[str, Health] | None,
    folder: Path,
) -> JsonObject:
    """Compare, draw the report, and write the result again with both; the arguments are ``finish``'s."""
    scored = written.scored
    own = own_subject(scored.run, scored.accuracy)
    agreement = agreement_of(scored.run, own, measured=experiment.measured)
    comparison = replace(compare(scored, experiment.sources(scored)), agreement=agreement)
    scored = replace(scored, warnings=(*scored.warnings, *comparison.notes))
    page = draw(scored, comparison, health, folder / "report")
    write_arrays(folder / OBSERVED, comparison.arrays(), compressed=True)
    plan = as_json(comparison.plan)
    for step in plan["ran"]:
        step["seconds"] = comparison.evaluation.seconds.get(step["effect"])
        step["calls"] = comparison.evaluation.calls.get(step["effect"], 0)
    result = {
        **written.result,
        "plan": plan,
        "observed": comparison.observed(),
        "agreement": agreement.as_json(),
        "warnings": [*written.result["warnings"], *comparison.notes],
        "report": str(page),
    }
    _write(folder / RESULT, result)
    return result


def common(experiment: AnyExperiment, scored: AnyScored) -> JsonObject:
    """What every result holds; keys carry their unit."""
    recording = scored.run.recording
    return {
        "schema": SCHEMA,
        "experiment": experiment.name,
        "object": scored.run.scene.object.name,
        "mock": recording.header.mock is not None,
        "seed": recording.header.seed,
        "plan": as_json(scene_plan(scored.run.scene, scored.run.station.gel.sensor, scored.accuracy)),
        "accuracy": dict(scored.accuracy),
        "world": None if scored.truth is None else dict(scored.truth.differences),
        "recording": str(recording.folder),
        "report": None,
    }


def levels_of_result(experiment: AnyExperiment, folder: Path) -> dict[str, Level]:
    """The levels that the result in a folder was found at; none where it has no result.

    Raises:
        RecordingDamaged: the result cannot be read, or was found at a level that is no longer there.
    """
    path = folder / RESULT
    if not path.exists():
        return {}
    try:
        levels = json.loads(read_bounded(path, "a result", MOST_JSON))["accuracy"]
        return current_levels(experiment.knobs, levels)
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError, WrongUse) as error:
        raise RecordingDamaged(
            f"{path} does not say at which levels it was found; replay the run into another folder"
        ) from error


def _write(path: Path, result: JsonObject) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text_whole(path, json.dumps(result, indent=1, allow_nan=False) + "\n")
