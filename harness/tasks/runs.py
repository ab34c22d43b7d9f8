"""Perform, resume and replay runs of experiments, and compare them with models of their objects."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from harness.agreement.agreement import Agreement
from harness.agreement.compare_run import agreement_of
from harness.agreement.subject import own_subject, subject_of_file
from harness.basics.errors import RecordingDamaged, TouchstoneError, WrongUse
from harness.basics.files.json_file import JsonObject
from harness.basics.files.lock_file import hold_folder
from harness.basics.result import HIDDEN, JSON_ONLY, JsonValue, Result
from harness.bench.experiments import DEFAULT_EXPERIMENT
from harness.bench.scene_objectfile import find_objectfile
from harness.bench.station_file import load_station, station_path
from harness.effects.accuracy import Accuracy
from harness.effects.catalogue import scene_levels
from harness.experiment.answer import (
    WrittenAnswer,
    add_report,
    common,
    finish,
    levels_of_result,
    score,
    write_answer,
)
from harness.experiment.begin import Begun, begin
from harness.experiment.budget import answer_as_asked, sentences
from harness.experiment.experiment import Answering, AnyExperiment, AnyScored, Procedure
from harness.experiment.front import doubts, foresee, front_for
from harness.experiment.levels import chosen_levels
from harness.experiment.lookup import experiment_of, find_experiment, require_of
from harness.experiment.perform import Performed, describe_bench, perform_on_bench, steps_planned
from harness.experiment.solving import Target, target_of
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.recording.session import Progress, Quiet
from harness.recording.wav_export import export_wav
from harness.report.run_page import write_run_page
from harness.skills.strike import Ask
from harness.tasks.scenes import SceneOptions, resolve


@dataclass(frozen=True, eq=False)
class RunResult(Result):
    """The answer of a run; its JSON is that of ``result.json``."""

    folder: Path = field(metadata=JSON_ONLY)  #: folder of ``result.json``.
    report: Path  #: HTML page.
    result: JsonObject = field(metadata=HIDDEN)  #: content of ``result.json``.

    def as_json(self) -> dict[str, JsonValue]:
        """Return the content of ``result.json`` as JSON values."""
        return dict(self.result)


@dataclass(frozen=True, eq=False)
class ComparedRun(Result):
    """The readings of a run, compared with a model of its object."""

    recording: Path = field(metadata=JSON_ONLY)
    agreement: Agreement = field(metadata=HIDDEN)

    def as_json(self) -> dict[str, JsonValue]:
        """Return the folder and the keys of the agreement as JSON values."""
        return {"schema": self.schema, "recording": str(self.recording), **self.agreement.as_json()}

    def summary(self) -> tuple[str, ...]:
        """State the verdict of each sense."""
        doubt = self.agreement.first_doubt
        return (
            f"{self.recording} against {self.agreement.about}",
            *(f"  {line}" for line in self.agreement.lines()),
            *([] if doubt is None else [f"first in doubt: {doubt[1]} at step {doubt[0] + 1}"]),
        )


@dataclass(frozen=True, eq=False)
class PlannedRun:
    """A run whose folder exists, before anything moves."""

    experiment: AnyExperiment
    files: RunFiles  #: folder of the run.
    accuracy: Accuracy  #: levels of the answer, if no target chooses them.
    target: Target | None  #: budget or error of the answer; None if levels are given.


class RunStopped(TouchstoneError):
    """Ctrl-C ended a run after a step; ``folder`` has the recorded steps."""

    exit_code = 130

    @classmethod
    def kind(cls) -> str:
        """Return the kind of this error in JSON output."""
        return "interrupted"

    def __init__(self, last_step: str, folder: Path, resume_command: str) -> None:
        self.folder = folder
        super().__init__(f"stopped after {last_step}; resume with `{resume_command}`")


class RunWatcher:
    """Receives the reports of a run; subclasses override the methods to show them."""

    ask: Ask | None = None  #: shows the operator what to do by hand; None if there is no operator.

    def show_plan(self, run: PlannedRun, begun: Begun) -> None:
        """Receive a new run and its rehearsed plan before anything moves; an error raised here ends it."""

    def report(self, sentence: str) -> None:
        """Receive a sentence about the progress."""

    def warn(self, sentence: str) -> None:
        """Receive a warning."""

    def track_steps(self, _done: int, _total: int, _noun: str) -> AbstractContextManager[Progress]:
        """Return a context of a progress, which receives the start and the end of each step."""
        return nullcontext(Quiet())

    def show_answer(self, lines: Sequence[str]) -> None:
        """Receive the answer in words, before the report is drawn."""


def run(
    experiment: str | None = None,
    scene: str | Path | SceneOptions | None = None,
    station: str | None = None,
    levels: Sequence[str] = (),
    budget: float | None = None,
    error: float | None = None,
    seed: int | None = None,
    gap: str | None = None,
    bench: str | None = None,
    out: Path | None = None,
    resume: Path | None = None,
    watcher: RunWatcher | None = None,
) -> RunResult:
    """Plan a run, rehearse it in the twin, perform it on a bench, answer it and draw its report.

    The first Ctrl-C ends the run after the step; the second one stops the arm.

    Args:
        experiment: name of the experiment; that of the resumed run or ``"contact-localization"`` if None.
        scene: name or file of a scene, or ``SceneOptions``, which describe an object and change settings.
        station: name or file of the bench; ``"mock"`` if None.
        levels: levels of knobs, e.g. ``"localization.method=particle"``.
        budget: time limit in s of the estimate; the most accurate levels within it are used.
        error: maximum error in m at 95 % confidence; the cheapest levels that meet it are used, or the run
            ends when its own estimate meets it.
        seed: random seed; that of the scene if None.
        gap: reality gap of a mocked bench; that of the experiment or the station if None.
        bench: form of a mocked bench, ``"in-process"`` or ``"wires"``; in process if None.
        out: folder of the run; a dated folder in ``runs/`` if None.
        resume: folder of a run to resume at its first missing step; the options that plan a run must be None.
        watcher: receives progress and the answer, and shows the operator what to do by hand.

    Raises:
        RunStopped: Ctrl-C ended the run early.
        TouchstoneError: the scene, bench, level or plan is refused and nothing has moved; or the bench or the
            answer failed, and the recorded steps are kept.
    """
    watcher = watcher or RunWatcher()
    if not isinstance(scene, SceneOptions):
        scene = SceneOptions(None if scene is None else Path(scene))
    if resume is not None:
        given = {
            "station": station,
            "seed": seed,
            "gap": gap,
            "bench": bench,
            "out": out,
            **vars(scene),
            **scene.keys,
        }
        planned = _open_to_resume(resume, experiment, given, levels, _target(budget, error, levels), watcher)
    else:
        kind = find_experiment(experiment or DEFAULT_EXPERIMENT)
        if error is not None and kind.error_key is not None:  # the run itself ends when that is met
            scene, error = scene.with_key(kind.error_key, f"{error!r}m"), None
        target = _target(budget, error, levels)
        chosen_levels(kind.knobs, levels)  # a wrong one is refused before any file is read
        resolved = resolve(scene, kind.section, kind.assumed)
        accuracy = chosen_levels(kind.knobs, levels, scene_levels(resolved))
        place = load_station(station_path(station or "mock"))
        if target is not None:
            watcher.report(foresee(kind, resolved, target))
        elif kind.section is not None and kind.error_key is not None:
            stated = vars(resolved.section(kind.section))[kind.error_key]
            if stated is not None:  # such an experiment has no curve
                watcher.report(
                    f"no curve promises an error of {kind.name} in advance: the run ends when its own "
                    f"estimate states {1e3 * stated:g} mm or less, at the latest after its last {kind.step}"
                )
        begun = begin(kind, resolved, place, seed, gap, out, bench, target)
        planned = PlannedRun(kind, RunFiles(begun.recording), accuracy, target)
        watcher.show_plan(planned, begun)
    with planned.files.recording.hold():
        return _perform_and_answer(planned, watcher)


def _open_to_resume(
    folder: Path,
    experiment: str | None,
    given: Mapping[str, object],
    levels: Sequence[str],
    target: Target | None,
    watcher: RunWatcher,
) -> PlannedRun:
    """Open a run to resume; it keeps its target if neither levels nor another target are given."""
    planning = {**given, "range": given["sizes"], "set": given["assignments"] or None}
    own = ("sizes", "assignments", "keys")  # not names of options
    options = [
        f"--{name.replace('_', '-')}"
        for name, value in planning.items()
        if value is not None and name not in own
    ]
    if options:
        raise WrongUse(
            f"--resume continues the run as planned; {', '.join(options)} cannot change it now: "
            "leave them out, or start another run"
        )
    recording = Recording(folder)
    kind = experiment_of(recording)
    if experiment is not None:
        require_of(recording, find_experiment(experiment).name, "--resume")
    files = RunFiles(recording)
    accuracy = chosen_levels(kind.knobs, levels, files.network_levels)
    if target is not None and recording.committed < steps_planned(kind, recording):
        watcher.report(foresee(kind, files.scene, target))
    if target is None and not levels:
        target = target_of(recording.header.plan)
    return PlannedRun(kind, files, accuracy, target)


def _target(budget: float | None, error: float | None, levels: Sequence[str]) -> Target | None:
    if budget is None and error is None:
        return None
    if budget is not None and error is not None:
        raise WrongUse("--budget and --error each choose the levels; give one of them")
    if levels:
        raise WrongUse("--budget and --error choose the levels; leave --level out, or choose all with it")
    return Target(budget, error)


def perform_run(
    procedure: Procedure,
    files: RunFiles,
    resume_command: str,
    watcher: RunWatcher,
    accuracy: Accuracy | None = None,
    conclude: Callable[[Performed], None] = lambda _: None,
) -> Performed:
    """Perform the missing steps of a run; no bench is opened if none is missing.

    Args:
        procedure: experiment or calibration of the run.
        files: folder of the run.
        resume_command: command that resumes the run, for messages.
        watcher: receives the progress.
        accuracy: levels of the answer, to process readings during the run; None if they are chosen later.
        conclude: receives the outcome while the bench is still open.

    Raises:
        RunStopped: Ctrl-C ended the run early.
        TouchstoneError: the bench failed; the recorded steps are kept.
    """
    recording = files.recording
    total = steps_planned(procedure, recording)
    if recording.committed == total:
        return Performed(True, {})
    watcher.report(f"bench: {describe_bench(recording)}")
    watcher.report(f"recording to {recording.folder}")
    try:
        with watcher.track_steps(recording.committed, total, procedure.step) as progress:
            done = perform_on_bench(
                procedure,
                files,
                progress,
                watcher.ask,
                accuracy,
                say=lambda sentence: watcher.report(f"  {sentence}"),
                conclude=conclude,
            )
    except TouchstoneError:
        watcher.warn(f"the recorded steps are kept; resume with `{resume_command}`")
        raise
    if not done.complete:
        raise RunStopped(f"{procedure.step} {recording.committed}", recording.folder, resume_command)
    return done


def _perform_and_answer(run: PlannedRun, watcher: RunWatcher) -> RunResult:
    """Perform the missing steps of a run and answer it.

    Without a target the answer is published while the bench is still open, as closing one takes time. A run
    that was performed before, or whose target chooses the levels, is answered once the bench is closed.
    """
    experiment, recording = run.experiment, run.files.recording
    written = list[WrittenAnswer[Answering, object]]()
    draw, publish = partial(write_run_page, experiment), partial(_publish, experiment, watcher)

    def conclude(done: Performed) -> None:
        if run.target is None:
            rest = recording.folder, done.answering, publish
            written.append(write_answer(experiment, run.files, run.accuracy, *rest, since=done.ended))

    resume_command = f"touchstone run {experiment.name} --resume {recording.folder}"
    accuracy = run.accuracy if run.target is None else None
    done = perform_run(experiment, run.files, resume_command, watcher, accuracy, conclude)
    health = done.health or None
    if written:
        result = add_report(experiment, written[0], draw, health, recording.folder)
        return RunResult(recording.folder, Path(result["report"]), result)
    accuracy, more = run.accuracy, {}
    if run.target is not None:
        front = front_for(experiment, run.files.scene, recording.committed)
        for doubt in doubts(experiment, front, run.target):
            watcher.warn(doubt)
        watcher.report("estimating at the chosen levels, then at the finest levels")
        cost = answer_as_asked(experiment, run.files, front, run.target)
        for sentence in sentences(experiment, cost):
            watcher.report(sentence)
        accuracy, more = run.accuracy.with_(cost["levels"]), {"cost": cost}
    result = finish(
        experiment,
        run.files,
        accuracy,
        draw,
        health,
        answering=done.answering,
        publish=publish,
        more=more,
        since=done.ended,
    )
    return RunResult(recording.folder, Path(result["report"]), result)


def _publish(experiment: AnyExperiment, watcher: RunWatcher, result: JsonObject) -> None:
    for warning in result["warnings"]:
        watcher.warn(warning)
    watcher.show_answer(experiment.lines(result))


def replay(
    run: str | Path,
    levels: Sequence[str] = (),
    out: Path | None = None,
    wav: Path | None = None,
    watcher: RunWatcher | None = None,
) -> RunResult:
    """Estimate again from a recorded run and draw its report; no bench is opened.

    Args:
        run: its folder.
        levels: levels that differ from those of the run's result, e.g. ``"localization.rounds=0"``.
        out: folder of result and report; that of the run with ``-replay`` appended if None.
        wav: folder for WAV files of the force and sound of every strike; None to write none.
        watcher: receives warnings and the answer.

    Raises:
        WrongUse: no run, a calibration's run, or an unknown knob.
        RecordingDamaged: a step or a file of the run is damaged.
        FitRefused: nothing explains the readings.
    """
    watcher, folder = watcher or RunWatcher(), Path(run)
    files = RunFiles(Recording(folder))
    kind = experiment_of(files.recording)
    if wav is not None:
        written = export_wav(files.recording, wav)
        watcher.warn(f"{len(written)} WAV files in {wav}; wav.json next to them has counts, rates and times")
    try:
        own = levels_of_result(kind, folder) or files.network_levels
    except RecordingDamaged as error:
        own = files.network_levels
        watcher.warn(f"{error}; using the default levels")
    accuracy = chosen_levels(kind.knobs, levels, own)
    target, publish = out or folder.with_name(f"{folder.name}-replay"), partial(_publish, kind, watcher)
    with hold_folder(target):
        result = finish(kind, files, accuracy, partial(write_run_page, kind), None, target, None, publish)
    return RunResult(target, Path(result["report"]), result)


def compare(run: str | Path, objectfile: str | Path | None = None, reference: bool = False) -> ComparedRun:
    """Compare a run's readings with a model of its object; no bench is opened, and no answer is needed.

    Args:
        run: its folder.
        objectfile: ObjectFile of another object to compare with: its folder or its name; None for the run's.
        reference: whether the reference simulation is compared too if networks replace it.

    Raises:
        WrongUse: no run, a calibration's run, or no ObjectFile.
        RecordingDamaged: a step or a file of the run is damaged.
    """
    folder = Path(run)
    files = RunFiles(Recording(folder))
    kind = experiment_of(files.recording)
    if objectfile is None:
        subject = own_subject(files, levels_of_result(kind, folder))
        return ComparedRun(folder, agreement_of(files, subject, reference, kind.measured))
    subject = subject_of_file(files, find_objectfile(objectfile))
    return ComparedRun(folder, agreement_of(files, subject, reference))


def answer(run: str | Path, levels: Sequence[str] = ()) -> dict[str, Any]:
    """Answer a recorded run; no bench is opened and nothing is written.

    Args:
        run: its folder.
        levels: levels of knobs, e.g. ``"localization.method=particle"``.

    Returns:
        The keys of ``result.json``, without those of the report.

    Raises:
        WrongUse: no run, a calibration's run, or an unknown knob.
        RecordingDamaged: a step or a file of the run is damaged.
        FitRefused: nothing explains the readings.
    """
    files = RunFiles(Recording(Path(run)))
    experiment = experiment_of(files.recording)
    accuracy = chosen_levels(experiment.knobs, levels, files.network_levels)
    scored: AnyScored = score(experiment, files, accuracy)
    return {**common(experiment, scored), **scored.result}
