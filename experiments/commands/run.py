"""``touchstone run``: an experiment on a bench, from the plan to the report."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from harness.basics.errors import WrongUse
from harness.commands import options
from harness.commands.output import ANSWERS, CONSOLE, emit, millimetres, resumable, step_progress, warn


class Experiment(StrEnum):
    """What can be run."""

    CONTACT_LOCALIZATION = "contact-localization"


class Spacing(StrEnum):
    """How far apart contacts are."""

    CLOSE = "close"
    SPREAD = "spread"


class Sense(StrEnum):
    """What is done at each place."""

    TOUCH = "touch"
    BOTH = "both"


class Yaw(StrEnum):
    """Whether the estimator is told the object's yaw."""

    KNOWN = "known"
    UNKNOWN = "unknown"


def run(
    experiment: Annotated[Experiment, typer.Argument(help="What to run.")] = Experiment.CONTACT_LOCALIZATION,
    station: options.StationOrOwn = None,
    scene: options.SceneOption = None,
    object_: options.Object = None,
    material: options.Material = None,
    units: options.Units = None,
    wall: options.Wall = None,
    objectfile: options.ObjectFileOption = None,
    seed: options.Seed = None,
    gap: options.GapOption = None,
    contacts: Annotated[int | None, typer.Option(help="How many contacts.", min=1, max=100)] = None,
    spacing: Annotated[
        Spacing | None, typer.Option(help="close: within 25 mm of the last; spread: over the object.")
    ] = None,
    yaw: Annotated[Yaw | None, typer.Option(help="Whether the estimator is told the object's yaw.")] = None,
    sense: Annotated[
        Sense | None, typer.Option(help="touch: press only; both: strike each place too, and listen.")
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
    from experiments.contact_localization import run as session_of
    from experiments.contact_localization.accuracy.dials import chosen
    from harness.bench.station_file import load_station, station_path
    from harness.commands.scenes import resolve
    from harness.recording.recording import Recording

    assert experiment is Experiment.CONTACT_LOCALIZATION
    accuracy = chosen(level or [])
    target = _target(budget, error, level)
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
            out=out,
            contacts=contacts,
            spacing=spacing,
            yaw=yaw,
            sense=sense,
        )
        recording = Recording(resume)
    else:
        wanted = resolve(scene, object_, material, units, wall, contacts, spacing, yaw, sense, objectfile)
        bench = load_station(station_path(station or "mock"))
        if target is not None:
            _foresee(target, wanted)
        begun = session_of.start(wanted, bench, wanted.localization.seed if seed is None else seed, gap, out)
        recording = begun.recording
        _describe(begun, accuracy)
    complete, health = _perform(recording, accuracy, json)
    if not complete:
        return _stopped(recording, json)
    cost = None
    if target is not None:
        with CONSOLE.status("estimating as asked, then at the finest levels"):
            cost = _answered(recording, target)
        accuracy = accuracy.with_(cost["levels"])
    with CONSOLE.status("estimating, comparing, drawing the report"):
        result = session_of.finish(recording, accuracy, health)
    if cost is not None:
        result = _with_cost(result, cost, recording)
    show(result, json)
    return 0


def _target(budget: str | None, error: str | None, level: list[str] | None) -> Any:
    """What was asked of the estimate; None where nothing was."""
    given = error if budget is None else budget
    if given is None:
        return None
    from experiments.contact_localization.accuracy.front import Target
    from harness.basics.quantities import LENGTH, TIME

    if budget is not None and error is not None:
        raise WrongUse("--budget and --error each choose the levels; give one of them")
    if level:
        raise WrongUse("--budget and --error choose the levels; leave --level out, or choose all with it")
    option, kind = ("--budget", TIME) if budget is not None else ("--error", LENGTH)
    value = options.quantity(option, given, kind)
    if value <= 0.0:
        raise WrongUse(f"{option} {given}: it must be above zero")
    return Target(seconds=value) if budget is not None else Target(error=value)


def _foresee(target: Any, scene: Any) -> None:
    """What will be tried, before anything moves; a budget that cannot be kept ends here."""
    from experiments.contact_localization.accuracy.front import foresee, front_for
    from experiments.contact_localization.accuracy.solving import object_key
    from harness.effects.scene_object import known_object

    front = front_for(scene, scene.localization.contacts)
    name = object_key(scene.object.name, known_object(scene).mesh)
    CONSOLE.print(foresee(front, target, name), markup=False)


def _answered(recording: Any, target: Any) -> dict[str, Any]:
    """The estimate as it was asked for, timed, and what the finest levels would have said."""
    from experiments.contact_localization.accuracy.front import front_for
    from experiments.contact_localization.accuracy.within import answer_within
    from experiments.contact_localization.accuracy.within_words import as_json, doubts
    from harness.recording.run_folder import RunFiles

    front = front_for(RunFiles(recording).scene, recording.committed)
    for doubt in doubts(front, target):
        warn(doubt)
    return as_json(answer_within(recording, front, target), front, target, recording)


def _with_cost(result: dict[str, Any], cost: dict[str, Any], recording: Any) -> dict[str, Any]:
    """The result, here and on the disk, with what was asked and what it took; said in two lines."""
    from json import dumps

    from experiments.contact_localization.accuracy.within_words import sentences
    from experiments.contact_localization.report.result import RESULT
    from harness.basics.whole_file import write_text_whole

    whole = {**result, "cost": cost}
    write_text_whole(recording.folder / RESULT, dumps(whole, indent=1, allow_nan=False) + "\n")
    for sentence in sentences(cost):
        CONSOLE.print(sentence, markup=False)
    return whole


def show(result: dict[str, Any], as_json: bool) -> None:
    """The answer in a line, what to mind, where the report is."""
    for warning in result["warnings"]:
        warn(warning)
    if as_json:
        emit(result)
        return
    for line in answer_lines(result):
        ANSWERS.print(line, markup=False)
    ANSWERS.print(f"report: {result['report']}", markup=False)


def answer_lines(result: dict[str, Any]) -> list[str]:
    """A line for each sense; the last one with the baselines."""
    estimates = result["estimates"]
    last = next(reversed(estimates))
    return [answer_line(result, sense, baselines=sense == last) for sense in estimates]


def answer_line(result: dict[str, Any], sense: str, baselines: bool) -> str:
    """The answer, its error where the truth is known, how sure it is, what it took, the baselines."""
    found = result["estimates"][sense]
    if "refused" in found:
        return f"{sense}: refused: {found['refused']}"
    x, y, z = (1e3 * value for value in found["position_m"])
    said = [
        f"{sense}: contact {result['contacts']} at ({x:.1f}, {y:.1f}, {z:.1f}) mm on the {result['object']}"
    ]
    if found["error_m"] is not None:
        symmetric = found["error_symmetric_m"]
        modulo = f" ({millimetres(symmetric)} modulo symmetry)" if symmetric < 0.9 * found["error_m"] else ""
        said.append(f"error {millimetres(found['error_m'])}{modulo}")
    if len(found["modes"]) > 1:
        said.append(f"{len(found['modes'])} likely places")
    said.append(f"90 % within {millimetres(found['credible90_m'])}")
    said.append(f"{found['seconds']:.2f} s")
    if baselines and result["geometry_baseline_m"] is not None:
        said.append(
            f"baselines: geometry alone {millimetres(result['geometry_baseline_m'])}, "
            f"random {millimetres(result['random_baseline_m'])}"
        )
    mock = "mock bench, " if result["mock"] else ""
    return mock + "; ".join(said)


def _stopped(recording: Any, as_json: bool) -> int:
    """Ctrl-C ended the session after a contact: how to go on."""
    said = (
        f"stopped after contact {recording.committed}; go on with "
        f"`touchstone run contact-localization --resume {recording.folder}`"
    )
    CONSOLE.print(said, markup=False)
    if as_json:
        emit({"schema": 1, "error": said, "exit_code": 130, "recording": str(recording.folder)})
    return 130


def _perform(recording: Any, accuracy: Any, as_json: bool) -> tuple[bool, Any]:
    from experiments.contact_localization import run as session_of

    total = len(recording.header.plan["contacts"])
    if recording.committed == total:
        return True, None  # nothing is left to touch: no bench is opened
    CONSOLE.print(f"recording to {recording.folder}", markup=False)
    how = f"touchstone run contact-localization --resume {recording.folder}"
    with resumable(how), step_progress(recording.committed, total) as progress:
        return session_of.perform_on_bench(recording, progress, None if as_json else _ask, accuracy)


def _ask(what: str) -> None:
    """Show the operator what to do now."""
    CONSOLE.print(what, markup=False, style="bold")


def _describe(begun: Any, accuracy: Any) -> None:
    """What is about to happen, before anything moves; what is simulated, at the levels that were turned."""
    from harness.effects.explain import as_table, left_out, scene_plan
    from harness.recording.run_folder import RunFiles

    run = RunFiles(begun.recording)
    wanted = run.scene.localization
    CONSOLE.print(
        f"{run.scene.object.name}: {len(run.mesh.faces)} faces, "
        f"longest side {1e3 * (run.mesh.bounds[1] - run.mesh.bounds[0]).max():.0f} mm; "
        f"{wanted.contacts} contacts, {wanted.spacing}; station {run.station.title}"
    )
    CONSOLE.print(
        f"rehearsed in the twin: {begun.plan.rehearsal.segments} motions, none refused; "
        f"{len(begun.plan.rehearsal.warnings)} warnings"
    )
    effects = scene_plan(run.scene, run.station.gel.sensor, accuracy)
    CONSOLE.print(as_table(effects, left_out=False))
    CONSOLE.print("not simulated:")
    for sentence in left_out(effects):
        CONSOLE.print(f"  {sentence}", markup=False)


def _refuse_with_resume(**given: object) -> None:
    named = [f"--{name}" for name, value in given.items() if value is not None]
    if named:
        raise WrongUse(
            f"--resume goes on with the run as it was planned; {', '.join(named)} cannot change it now: "
            "leave them out, or start another run"
        )
