"""A planned run is performed, its answer printed, its report drawn."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from harness.commands.output import ANSWERS, CONSOLE, emit, resumable, step_progress, stopped, warn
from harness.commands.run.planned_run import PlannedRun
from harness.effects.accuracy import Accuracy
from harness.experiment.answer import Draw, Publish, WrittenAnswer, add_report, finish, write_answer
from harness.experiment.budget import answer_as_asked, sentences
from harness.experiment.experiment import Experiment
from harness.experiment.front import doubts, front_for
from harness.experiment.perform import Performed, describe_bench, perform_on_bench, steps_planned
from harness.recording.run_folder import RunFiles
from harness.report.run_page import write_run_page


def perform_and_answer(run: PlannedRun, as_json: bool) -> int:
    """Perform what is left of a run and answer it; the exit code.

    Without a target the answer is printed while the bench is still open: closing one takes its time.

    Raises:
        TouchstoneError: of the bench, or of the answer; what was recorded is kept.
    """
    with run.recording.hold():
        return _perform_and_answer(run, as_json)


def _perform_and_answer(run: PlannedRun, as_json: bool) -> int:
    written: list[WrittenAnswer] = []

    def conclude(done: Performed) -> None:
        if run.target is None:
            written.append(_written(run, done, as_json))

    done = _performed(run, as_json, conclude)
    if not done.complete:
        step = f"{run.experiment.step} {run.recording.committed}"
        return stopped(step, run.recording.folder, _resuming(run), as_json)
    if written:
        draw, folder = drawing(run.experiment), run.recording.folder
        result = add_report(run.experiment, written[0], draw, done.health or None, folder)
    else:
        result = _answered_late(run, done, as_json)
    show_report(result, as_json)
    return 0


def _written(run: PlannedRun, done: Performed, as_json: bool) -> WrittenAnswer:
    """The answer, once the last step is on the disk."""
    return write_answer(
        run.experiment,
        run.recording,
        run.accuracy,
        run.recording.folder,
        done.answering,
        publisher(run.experiment, as_json),
        since=done.ended,
    )


def _answered_late(run: PlannedRun, done: Performed, as_json: bool) -> dict[str, Any]:
    """The result of a run that was performed before, or at the levels that keep its target."""
    cost = {} if run.target is None else {"cost": _cost_of_target(run)}
    accuracy = run.accuracy.with_(cost["cost"]["levels"]) if cost else run.accuracy
    return finish(
        run.experiment,
        run.recording,
        accuracy,
        drawing(run.experiment),
        done.health or None,
        answering=done.answering,
        publish=publisher(run.experiment, as_json),
        more=cost,
        since=done.ended,
    )


def _cost_of_target(run: PlannedRun) -> dict[str, Any]:
    """The levels that keep the target, and what they cost; doubts and cost are printed."""
    assert run.target is not None
    front = front_for(run.experiment, RunFiles(run.recording).scene, run.recording.committed)
    for doubt in doubts(run.experiment, front, run.target):
        warn(doubt)
    with CONSOLE.status("estimating as asked, then at the finest levels"):
        cost = answer_as_asked(run.experiment, run.recording, front, run.target)
    for sentence in sentences(run.experiment, cost):
        CONSOLE.print(sentence, markup=False)
    return cost


def _performed(run: PlannedRun, as_json: bool, conclude: Callable[[Performed], None]) -> Performed:
    """What is left of the run; where no target chooses the levels, readings are taken in on the way."""
    total = steps_planned(run.experiment, run.recording)
    if run.recording.committed == total:
        return Performed(True, {})  # nothing is left to touch: no bench is opened
    CONSOLE.print(f"bench: {describe_bench(run.recording)}", markup=False)
    CONSOLE.print(f"recording to {run.recording.folder}", markup=False)
    accuracy: Accuracy | None = run.accuracy if run.target is None else None
    with (
        resumable(_resuming(run)),
        step_progress(run.recording.committed, total, run.experiment.step) as progress,
    ):
        ask = None if as_json else _ask
        given = run.experiment, run.recording, progress, ask, accuracy
        return perform_on_bench(*given, say=progress.say, conclude=conclude)


def _resuming(run: PlannedRun) -> str:
    """The command that goes on with a run."""
    return f"touchstone run {run.experiment.name} --resume {run.recording.folder}"


def _ask(what: str) -> None:
    """Show the operator what to do now."""
    CONSOLE.print(what, markup=False, style="bold")


def publisher(experiment: Experiment, as_json: bool) -> Publish:
    """Prints the answer as soon as it is known, before the report is drawn."""

    def publish(result: Mapping[str, Any]) -> None:
        for warning in result["warnings"]:
            warn(warning)
        if not as_json:
            for line in experiment.lines(result):
                ANSWERS.print(line, markup=False)
            CONSOLE.print("comparing with the simulation, drawing the report", markup=False)

    return publish


def drawing(experiment: Experiment) -> Draw:
    """Draws the plain page of an experiment that has none of its own."""
    return partial(write_run_page, experiment)


def show_report(result: dict[str, Any], as_json: bool) -> None:
    """Where the report is; the one object of ``--json``."""
    if as_json:
        emit(result)
    else:
        ANSWERS.print(f"report: {result['report']}", markup=False)
