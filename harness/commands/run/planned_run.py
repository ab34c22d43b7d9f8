"""A run before it moves: planned anew, or gone on with."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from harness.basics.errors import WrongUse
from harness.basics.quantities import LENGTH, TIME
from harness.bench.station_file import load_station, station_path
from harness.commands.options import positive
from harness.commands.output import CONSOLE
from harness.commands.scenes import SceneOptions, resolve
from harness.effects.accuracy import Accuracy
from harness.effects.explain import as_table, left_out, scene_plan
from harness.effects.explain_networks import networks_as_table, networks_in_use
from harness.effects.file_levels import scene_levels
from harness.experiment.begin import Begun, begin
from harness.experiment.experiment import Experiment
from harness.experiment.front import foresee
from harness.experiment.levels import chosen_levels
from harness.experiment.lookup import experiment_of, named, require_of
from harness.experiment.perform import steps_planned
from harness.experiment.solving import Target, target_of
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles


@dataclass(frozen=True, eq=False)
class PlannedRun:
    """A run whose folder is there.

    Attributes:
        experiment: that it is of.
        recording: its folder.
        accuracy: of the answer, where no target chooses it.
        target: a budget or an error that the answer is to keep; None where levels are given.
    """

    experiment: Experiment
    recording: Recording
    accuracy: Accuracy
    target: Target | None


@dataclass(frozen=True)
class BenchOptions:
    """On which bench a run is made, and from what it is drawn; None for what station and scene say.

    Attributes:
        station: its name or file; the mocked bench where None.
        seed: of all that is drawn.
        gap: between a mocked bench and its model.
        bench: how a mocked one is run.
        out: folder of the run.
    """

    station: str | None = None
    seed: int | None = None
    gap: str | None = None
    bench: str | None = None
    out: Path | None = None


def new_run(
    experiment: Experiment,
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
        _describe_end(experiment, vars(wanted.section(experiment.section))[experiment.error_key])
    begun = begin(experiment, wanted, station, bench.seed, bench.gap, bench.out, bench.bench, target)
    _describe(experiment, begun, accuracy)
    return PlannedRun(experiment, begun.recording, accuracy, target)


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
    _require_unchanged(bench, scene)
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
    return PlannedRun(kind, recording, accuracy, target)


def _require_unchanged(bench: BenchOptions, scene: SceneOptions) -> None:
    """Refuse options that would plan a run otherwise, and name them."""
    given = {**vars(bench), **vars(scene), **scene.keys}
    given.update(range=given.pop("sizes"), set=given.pop("assignments") or None, keys=None)
    options = [f"--{name}" for name, value in given.items() if value is not None]
    if options:
        raise WrongUse(
            f"--resume goes on with the run as it was planned; {', '.join(options)} cannot change it now: "
            "leave them out, or start another run"
        )


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


def _describe_end(experiment: Experiment, error: float | None) -> None:
    """State when a run ends whose own estimate is compared with ``--error``; it has no curve."""
    if error is not None:
        CONSOLE.print(
            f"no curve promises an error of {experiment.name} in advance: the run ends when its own estimate "
            f"states {1e3 * error:g} mm or less, at the latest after its last {experiment.step}"
        )


def _describe(experiment: Experiment, begun: Begun, accuracy: Accuracy) -> None:
    """What is about to happen, before anything moves; what is simulated, at the levels that were turned."""
    run = RunFiles(begun.recording)
    for line in begun.known.read:
        CONSOLE.print(line, markup=False)
    section = None if experiment.section is None else run.scene.section(experiment.section)
    CONSOLE.print(
        f"{run.scene.object.name}: {len(run.mesh.faces)} faces, "
        f"longest side {1e3 * (run.mesh.bounds[1] - run.mesh.bounds[0]).max():.0f} mm; "
        f"{len(begun.plan.steps)} {experiment.plural}{_spaced(section)}; station {run.station.title}"
    )
    CONSOLE.print(
        f"rehearsed in the twin: {begun.plan.rehearsal.segments} motions, none refused; "
        f"{len(begun.plan.rehearsal.warnings)} warnings" + _on_the_way(begun.plan.on_the_way, experiment)
    )
    effects = scene_plan(run.scene, run.station.gel.sensor, accuracy)
    CONSOLE.print(as_table(effects, left_out=False))
    networks = networks_in_use(run.scene, effects)
    if networks:
        CONSOLE.print(networks_as_table(networks))
    CONSOLE.print("not simulated:")
    for sentence in left_out(effects):
        CONSOLE.print(f"  {sentence}", markup=False)


def _on_the_way(count: int, experiment: Experiment) -> str:
    """What is said of steps that are not planned yet."""
    if count == 0:
        return ""
    what = f"{count} {experiment.plural} are" if count > 1 else f"1 {experiment.step} is"
    return f"; {what} planned, and rehearsed, once those before are read"


def _spaced(section: Any) -> str:
    spacing = None if section is None else vars(section).get("spacing")
    return "" if spacing is None else f", {spacing}"
