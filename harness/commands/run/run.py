"""``touchstone run``: an experiment on a bench, from the plan to the report."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from harness.basics.errors import WrongUse
from harness.bench.experiments import EXPERIMENTS
from harness.commands import options
from harness.commands.output import ANSWERS, CONSOLE, emit, resumable, step_progress, stopped, warn

RUNNABLE = tuple(name for name, row in EXPERIMENTS.items() if row.value is not None)

DEFAULT = "contact-localization"
"""Run where no experiment is named."""


class Spacing(StrEnum):
    """How far apart contacts are."""

    CLOSE = "close"
    SPREAD = "spread"


class BenchKind(StrEnum):
    """How a mocked bench is run."""

    WIRES = "wires"
    IN_PROCESS = "in-process"


class Yaw(StrEnum):
    """Whether the estimator knows the object's yaw."""

    KNOWN = "known"
    UNKNOWN = "unknown"


BenchOption = Annotated[
    BenchKind | None,
    typer.Option(
        help="Of a mocked station. wires: each instrument at the far end of its cable, in real time; "
        "in-process: the same world without cables, in simulated time. wires if left out.",
    ),
]


def run(
    experiment: Annotated[
        str | None,
        typer.Argument(help=f"What to run: {', '.join(RUNNABLE)}; {DEFAULT} if left out.", metavar="NAME"),
    ] = None,
    station: options.StationOrOwn = None,
    scene: options.SceneOption = None,
    object_: options.Object = None,
    material: options.Material = None,
    units: options.Units = None,
    wall: options.Wall = None,
    objectfile: options.ObjectFileOption = None,
    seed: options.Seed = None,
    gap: options.GapOption = None,
    bench: BenchOption = None,
    set_: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            help="A key of the experiment's table in the scene, as contacts=4; again for more.",
            metavar="KEY=VALUE",
        ),
    ] = None,
    contacts: Annotated[int | None, typer.Option(help="How many contacts.", min=1, max=100)] = None,
    presses: Annotated[
        int | None, typer.Option(help="How many presses of an object of unknown shape.", min=0, max=100)
    ] = None,
    spacing: Annotated[
        Spacing | None, typer.Option(help="close: within 25 mm of the last; spread: over the object.")
    ] = None,
    yaw: Annotated[Yaw | None, typer.Option(help="Whether the estimator knows the object's yaw.")] = None,
    sense: Annotated[
        str | None,
        typer.Option(
            help="touch: press only; both: strike each place too, and listen; or any of vision, audio and "
            "touch with commas between."
        ),
    ] = None,
    range_: Annotated[
        tuple[str, str] | None,
        typer.Option(
            "--range",
            help="The longest side that an object of unknown size may have, as 5cm 30cm.",
            metavar="LOW HIGH",
        ),
    ] = None,
    level: options.LevelOption = None,
    budget: options.Budget = None,
    error: options.ErrorWanted = None,
    out: Annotated[
        Path | None, typer.Option(help="The run's folder; a dated one under runs/ if left out.")
    ] = None,
    resume: Annotated[
        Path | None, typer.Option(help="Go on with this run folder at its first missing contact.")
    ] = None,
    json: options.Json = False,
) -> int:
    """Run an experiment on a bench; with --resume, go on where one stopped.

    The motion is rehearsed in the twin before anything moves. Each contact is on the disk before the
    next begins. Ctrl-C once ends after the contact; twice stops the arm.

    Try: touchstone run contact-localization --station mock --scene scenes/mug_touch.toml
    """
    from harness.bench.station_file import load_station, station_path
    from harness.commands.scenes import resolve
    from harness.effects.file_levels import scene_levels
    from harness.experiment.answer import add_report, finish, write_answer
    from harness.experiment.begin import begin
    from harness.experiment.budget import answer_as_asked, sentences
    from harness.experiment.front import doubts, foresee, front_for
    from harness.experiment.levels import chosen_levels
    from harness.experiment.lookup import experiment_of, named, require_of
    from harness.experiment.solving import target_of
    from harness.recording.recording import Recording
    from harness.recording.run_folder import RunFiles

    kind = named(experiment or DEFAULT)
    ends_run = error is not None and resume is None and kind.error_key is not None
    target = _target(budget, None if ends_run else error, level)
    if resume is not None:
        _refuse_with_resume(
            station=station,
            scene=scene,
            object=object_,
            material=material,
            units=units,
            wall=wall,
            objectfile=objectfile,
            seed=seed,
            gap=gap,
            bench=bench,
            out=out,
            set=set_,
            contacts=contacts,
            presses=presses,
            spacing=spacing,
            yaw=yaw,
            sense=sense,
            range=range_,
        )
        recording = Recording(resume)
        kind = experiment_of(recording)
        if experiment is not None:
            require_of(recording, named(experiment).name, "--resume")
        accuracy = chosen_levels(kind.knobs, level or [], RunFiles(recording).network_levels)
        if target is None and not level:
            target = target_of(recording.header.plan)
    else:
        _ = chosen_levels(kind.knobs, level or [])  # a wrong one is refused before any file is read
        keys: dict[str, Any] = {"contacts": contacts, "presses": presses, "spacing": spacing, "yaw": yaw}
        if ends_run and kind.error_key is not None:
            keys[kind.error_key] = error
        wanted = resolve(
            scene,
            object_,
            material,
            units,
            wall,
            sense,
            objectfile,
            kind.section,
            keys,
            set_ or [],
            range_,
            kind.assumed,
        )
        accuracy = chosen_levels(kind.knobs, level or [], scene_levels(wanted))
        of = load_station(station_path(station or "mock"))
        if target is not None:
            CONSOLE.print(foresee(kind, wanted, target), markup=False)
        begun = begin(kind, wanted, of, seed, gap, out, bench, target)
        recording = begun.recording
        _describe(kind, begun, accuracy)
    written: list[Any] = []

    def conclude(done: Any) -> None:
        if target is None:
            publish = publisher(kind, json)
            folder, since = recording.folder, done.ended
            written.append(
                write_answer(kind, recording, accuracy, folder, done.answering, publish, None, since)
            )

    done = _perform(kind, recording, accuracy if target is None else None, json, conclude)
    if not done.complete:
        step = f"{kind.step} {recording.committed}"
        return stopped(step, recording.folder, _resuming(kind, recording), json)
    if written:
        health = done.health or None
        show_report(add_report(kind, written[0], drawing(kind), health, recording.folder), json)
        return 0
    more: dict[str, Any] = {}
    if target is not None:
        front = front_for(kind, RunFiles(recording).scene, recording.committed)
        for doubt in doubts(kind, front, target):
            warn(doubt)
        with CONSOLE.status("estimating as asked, then at the finest levels"):
            more["cost"] = answer_as_asked(kind, recording, front, target)
        accuracy = accuracy.with_(more["cost"]["levels"])
        for sentence in sentences(kind, more["cost"]):
            CONSOLE.print(sentence, markup=False)
    result = finish(
        kind,
        recording,
        accuracy,
        drawing(kind),
        done.health or None,
        None,
        done.answering,
        publisher(kind, json),
        more,
        done.ended,
    )
    show_report(result, json)
    return 0


def publisher(kind: Any, as_json: bool) -> Any:
    """Says the answer as soon as it is known, before the report is drawn."""

    def publish(result: Any) -> None:
        for warning in result["warnings"]:
            warn(warning)
        if not as_json:
            for line in kind.lines(result):
                ANSWERS.print(line, markup=False)
            CONSOLE.print("comparing with the simulation, drawing the report", markup=False)

    return publish


def drawing(kind: Any) -> Any:
    """Draws the plain page of an experiment that has none of its own."""
    from functools import partial

    from harness.report.run_page import write_run_page

    return partial(write_run_page, kind)


def show_report(result: dict[str, Any], as_json: bool) -> None:
    """Where the report is; the one object of ``--json``."""
    if as_json:
        emit(result)
    else:
        ANSWERS.print(f"report: {result['report']}", markup=False)


def _target(budget: str | None, error: str | None, level: list[str] | None) -> Any:
    """What was asked of the estimate; None where nothing was."""
    given = error if budget is None else budget
    if given is None:
        return None
    from harness.basics.quantities import LENGTH, TIME
    from harness.experiment.solving import Target

    if budget is not None and error is not None:
        raise WrongUse("--budget and --error each choose the levels; give one of them")
    if level:
        raise WrongUse("--budget and --error choose the levels; leave --level out, or choose all with it")
    option, kind = ("--budget", TIME) if budget is not None else ("--error", LENGTH)
    value = options.positive(option, given, kind)
    return Target(seconds=value) if budget is not None else Target(error=value)


def _resuming(kind: Any, recording: Any) -> str:
    """The command that goes on with a run."""
    return f"touchstone run {kind.name} --resume {recording.folder}"


def _perform(kind: Any, recording: Any, accuracy: Any, as_json: bool, conclude: Any) -> Any:
    """What is left of the run; with an accuracy, its readings are taken in on the way."""
    from harness.experiment.perform import Performed, perform_on_bench, steps_planned

    total = steps_planned(kind, recording)
    if recording.committed == total:
        return Performed(True, {})  # nothing is left to touch: no bench is opened
    CONSOLE.print(f"recording to {recording.folder}", markup=False)
    with (
        resumable(_resuming(kind, recording)),
        step_progress(recording.committed, total, kind.step) as progress,
    ):
        ask = None if as_json else _ask
        return perform_on_bench(kind, recording, progress, ask, accuracy, conclude=conclude)


def _ask(what: str) -> None:
    """Show the operator what to do now."""
    CONSOLE.print(what, markup=False, style="bold")


def _describe(kind: Any, begun: Any, accuracy: Any) -> None:
    """What is about to happen, before anything moves; what is simulated, at the levels that were turned."""
    from harness.effects.explain import as_table, left_out, scene_plan
    from harness.effects.explain_networks import networks_as_table, networks_in_use
    from harness.recording.run_folder import RunFiles

    run = RunFiles(begun.recording)
    for line in begun.known.read:
        CONSOLE.print(line, markup=False)
    wanted = None if kind.section is None else run.scene.section(kind.section)
    CONSOLE.print(
        f"{run.scene.object.name}: {len(run.mesh.faces)} faces, "
        f"longest side {1e3 * (run.mesh.bounds[1] - run.mesh.bounds[0]).max():.0f} mm; "
        f"{len(begun.plan.steps)} {kind.plural}{_spaced(wanted)}; station {run.station.title}"
    )
    CONSOLE.print(
        f"rehearsed in the twin: {begun.plan.rehearsal.segments} motions, none refused; "
        f"{len(begun.plan.rehearsal.warnings)} warnings"
    )
    effects = scene_plan(run.scene, run.station.gel.sensor, accuracy)
    CONSOLE.print(as_table(effects, left_out=False))
    networks = networks_in_use(run.scene, effects)
    if networks:
        CONSOLE.print(networks_as_table(networks))
    CONSOLE.print("not simulated:")
    for sentence in left_out(effects):
        CONSOLE.print(f"  {sentence}", markup=False)


def _spaced(section: Any) -> str:
    spacing = None if section is None else vars(section).get("spacing")
    return "" if spacing is None else f", {spacing}"


def _refuse_with_resume(**given: object) -> None:
    named = [f"--{name}" for name, value in given.items() if value is not None]
    if named:
        raise WrongUse(
            f"--resume goes on with the run as it was planned; {', '.join(named)} cannot change it now: "
            "leave them out, or start another run"
        )
