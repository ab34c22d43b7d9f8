"""A run before it moves: planned anew, or gone on with."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from harness.basics.errors import WrongUse
from harness.basics.quantities import LENGTH, TIME
from harness.bench.station_file import load_station, station_path
from harness.commands.options import positive
from harness.commands.output import ANSWERS, CONSOLE, emit, resumable, step_progress, stopped, warn
from harness.commands.scenes import SceneOptions, resolve
from harness.effects.accuracy import Accuracy
from harness.effects.catalogue import scene_levels
from harness.effects.explain import as_table, left_out, networks_as_table, networks_in_use, scene_plan
from harness.experiment.answer import Publish, WrittenAnswer, add_report, finish, write_answer
from harness.experiment.begin import Begun, begin
from harness.experiment.budget import answer_as_asked, sentences
from harness.experiment.experiment import Answering, AnyExperiment
from harness.experiment.front import doubts, foresee, front_for
from harness.experiment.levels import chosen_levels
from harness.experiment.lookup import experiment_of, named, require_of
from harness.experiment.perform import Performed, describe_bench, perform_on_bench, steps_planned
from harness.experiment.solving import Target, target_of
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.report.run_page import write_run_page


@dataclass(frozen=True, eq=False)
class PlannedRun:
    """A run whose folder is there."""

    experiment: AnyExperiment  #: that it is of.
    files: RunFiles  #: its folder.
    accuracy: Accuracy  #: of the answer, where no target chooses it.
    target: Target | None  #: a budget or an error that the answer is to keep; None where levels are given.


@dataclass(frozen=True)
class BenchOptions:
    """On which bench a run is made, and from what it is drawn; None for what station and scene say."""

    station: str | None = None  #: its name or file; the mocked bench where None.
    seed: int | None = None  #: of all that is drawn.
    gap: str | None = None  #: between a mocked bench and its model.
    bench: str | None = None  #: how a mocked one is run.
    out: Path | None = None  #: folder of the run.


def new_run(
    experiment: AnyExperiment,
    scene: SceneOptions,
    bench: BenchOptions,
    levels: Sequence[str],
    target: Target | None,
) -> PlannedRun:
    """Plan a run, rehearse it and say what is about to happen.

    Raises:
        TouchstoneError: the scene, the bench, a level or the plan is refused; nothing has moved.
    """
    chosen_levels(experiment.knobs, levels)  # a wrong one is refused before any file is read
    wanted = resolve(scene, experiment.section, experiment.assumed)
    accuracy = chosen_levels(experiment.knobs, levels, scene_levels(wanted))
    station = load_station(station_path(bench.station or "mock"))
    if target is not None:
        CONSOLE.print(foresee(experiment, wanted, target), markup=False)
    elif experiment.section is not None and experiment.error_key is not None:
        error = vars(wanted.section(experiment.section))[experiment.error_key]
        if error is not None:  # such an experiment has no curve
            CONSOLE.print(
                f"no curve promises an error of {experiment.name} in advance: the run ends when its own "
                f"estimate states {1e3 * error:g} mm or less, at the latest after its last {experiment.step}"
            )
    begun = begin(experiment, wanted, station, bench.seed, bench.gap, bench.out, bench.bench, target)
    _describe(experiment, begun, accuracy)
    return PlannedRun(experiment, RunFiles(begun.recording), accuracy, target)


def resumed_run(
    folder: Path,
    experiment: str | None,
    scene: SceneOptions,
    bench: BenchOptions,
    levels: Sequence[str],
    target: Target | None,
) -> PlannedRun:
    """Go on with a run; its own target is kept where neither levels nor another one are given.

    Args:
        folder: of the run.
        experiment: name of the one that it must be of; None where any will do.
        scene: must say nothing.
        bench: must say nothing either.
        levels: as they were written.
        target: of this time.

    Raises:
        WrongUse: the run is of another experiment, a level is unknown, or an option would plan it otherwise.
        RecordingDamaged: the folder holds no run that reads.
    """
    given = {**vars(bench), **vars(scene), **scene.keys}
    given.update(range=given.pop("sizes"), set=given.pop("assignments") or None, keys=None)
    options = [f"--{name}" for name, value in given.items() if value is not None]
    if options:
        raise WrongUse(
            f"--resume goes on with the run as it was planned; {', '.join(options)} cannot change it now: "
            "leave them out, or start another run"
        )
    recording = Recording(folder)
    kind = experiment_of(recording)
    if experiment is not None:
        require_of(recording, named(experiment).name, "--resume")
    files = RunFiles(recording)
    accuracy = chosen_levels(kind.knobs, levels, files.network_levels)
    if target is not None and recording.committed < steps_planned(kind, recording):
        CONSOLE.print(foresee(kind, files.scene, target), markup=False)
    if target is None and not levels:
        target = target_of(recording.header.plan)
    return PlannedRun(kind, files, accuracy, target)


def target_of_options(budget: str | None, error: str | None, levels: Sequence[str]) -> Target | None:
    """The budget or error of a command line; None where neither is given.

    Raises:
        WrongUse: both are, or levels beside one of them, or no time or length above zero.
    """
    given = error if budget is None else budget
    if given is None:
        return None
    if budget is not None and error is not None:
        raise WrongUse("--budget and --error each choose the levels; give one of them")
    if levels:
        raise WrongUse("--budget and --error choose the levels; leave --level out, or choose all with it")
    option, kind = ("--budget", TIME) if budget is not None else ("--error", LENGTH)
    value = positive(option, given, kind)
    return Target(seconds=value) if budget is not None else Target(error=value)


def _describe(experiment: AnyExperiment, begun: Begun, accuracy: Accuracy) -> None:
    """What is about to happen, before anything moves; what is simulated, at the levels that were turned."""
    run = RunFiles(begun.recording)
    for line in begun.known.read:
        CONSOLE.print(line, markup=False)
    section = {} if experiment.section is None else vars(run.scene.section(experiment.section))
    spaced = f", {section['spacing']}" if section.get("spacing") is not None else ""
    later, waiting = begun.plan.on_the_way, ""
    if later:
        what = f"{later} {experiment.plural} are" if later > 1 else f"1 {experiment.step} is"
        waiting = f"; {what} planned, and rehearsed, once those before are read"
    CONSOLE.print(
        f"{run.scene.object.name}: {len(run.mesh.faces)} faces, "
        f"longest side {1e3 * (run.mesh.bounds[1] - run.mesh.bounds[0]).max():.0f} mm; "
        f"{len(begun.plan.steps)} {experiment.plural}{spaced}; station {run.station.title}"
    )
    CONSOLE.print(
        f"rehearsed in the twin: {begun.plan.rehearsal.segments} motions, none refused; "
        f"{len(begun.plan.rehearsal.warnings)} warnings{waiting}"
    )
    effects = scene_plan(run.scene, run.station.gel.sensor, accuracy)
    CONSOLE.print(as_table(effects, left_out=False))
    networks = networks_in_use(run.scene, effects)
    if networks:
        CONSOLE.print(networks_as_table(networks))
    CONSOLE.print("not simulated:")
    for sentence in left_out(effects):
        CONSOLE.print(f"  {sentence}", markup=False)


def perform_and_answer(run: PlannedRun, as_json: bool) -> int:
    """Perform what is left of a run and answer it; the exit code.

    Without a target the answer is printed while the bench is still open: closing one takes its time. A run
    that was performed before, or whose target chooses the levels, is answered once the bench is closed.

    Raises:
        TouchstoneError: of the bench, or of the answer; what was recorded is kept.
    """
    experiment, recording, written = (
        run.experiment,
        run.files.recording,
        list[WrittenAnswer[Answering, object]](),
    )
    draw, publish = partial(write_run_page, experiment), publisher(experiment, as_json)

    def conclude(done: Performed) -> None:
        if run.target is None:
            rest = recording.folder, done.answering, publish
            written.append(write_answer(experiment, run.files, run.accuracy, *rest, since=done.ended))

    with recording.hold():
        done = _performed(run, as_json, conclude)
        if not done.complete:
            step = f"{experiment.step} {recording.committed}"
            return stopped(step, recording.folder, _resuming(run), as_json)
        health = done.health or None
        if written:
            result = add_report(experiment, written[0], draw, health, recording.folder)
        else:
            cost = {} if run.target is None else {"cost": _cost_of_target(run)}
            accuracy = run.accuracy.with_(cost["cost"]["levels"]) if cost else run.accuracy
            rest = accuracy, draw, health
            result = finish(
                experiment,
                run.files,
                *rest,
                answering=done.answering,
                publish=publish,
                more=cost,
                since=done.ended,
            )
        show_report(result, as_json)
        return 0


def _cost_of_target(run: PlannedRun) -> Mapping[str, Any]:
    """The levels that keep the target, and what they cost; doubts and cost are printed."""
    assert run.target is not None
    front = front_for(run.experiment, run.files.scene, run.files.recording.committed)
    for doubt in doubts(run.experiment, front, run.target):
        warn(doubt)
    with CONSOLE.status("estimating as asked, then at the finest levels"):
        cost = answer_as_asked(run.experiment, run.files, front, run.target)
    for sentence in sentences(run.experiment, cost):
        CONSOLE.print(sentence, markup=False)
    return cost


def _performed(run: PlannedRun, as_json: bool, conclude: Callable[[Performed], None]) -> Performed:
    """What is left of the run; where no target chooses the levels, readings are taken in on the way."""
    total = steps_planned(run.experiment, run.files.recording)
    if run.files.recording.committed == total:
        return Performed(True, {})  # nothing is left to touch: no bench is opened
    CONSOLE.print(f"bench: {describe_bench(run.files.recording)}", markup=False)
    CONSOLE.print(f"recording to {run.files.recording.folder}", markup=False)
    accuracy: Accuracy | None = run.accuracy if run.target is None else None
    with (
        resumable(_resuming(run)),
        step_progress(run.files.recording.committed, total, run.experiment.step) as progress,
    ):
        ask = None if as_json else partial(CONSOLE.print, markup=False, style="bold")
        given = run.experiment, run.files, progress, ask, accuracy
        return perform_on_bench(*given, say=progress.say, conclude=conclude)


def _resuming(run: PlannedRun) -> str:
    """The command that goes on with a run."""
    return f"touchstone run {run.experiment.name} --resume {run.files.recording.folder}"


def publisher(experiment: AnyExperiment, as_json: bool) -> Publish:
    """Prints the answer as soon as it is known, before the report is drawn."""

    def publish(result: Mapping[str, Any]) -> None:
        for warning in result["warnings"]:
            warn(warning)
        if not as_json:
            for line in experiment.lines(result):
                ANSWERS.print(line, markup=False)
            CONSOLE.print("comparing with the simulation, drawing the report", markup=False)

    return publish


def show_report(result: Mapping[str, Any], as_json: bool) -> None:
    """Where the report is; the one object of ``--json``."""
    if as_json:
        emit(result)
    else:
        ANSWERS.print(f"report: {result['report']}", markup=False)
