"""The part of ``touchstone calibrate taxim`` that moves the arm: plan, press, say how it goes."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from harness.basics.errors import WrongUse
from harness.commands.output import CONSOLE, emit, resumable
from harness.recording.step_file import Step

if TYPE_CHECKING:
    from harness.recording.recording import Recording


@dataclass(frozen=True)
class PressRequest:
    """What was asked for by options, None where nothing was."""

    station: str | None
    scene: Path | None
    resume: Path | None
    run: Path | None
    presses: int | None
    depth: float | None
    ball_radius: float | None
    seed: int | None
    gap: str | None

    def require_none(self, why: str) -> None:
        """Refuse options that only a new run of the arm can follow."""
        given = {
            "--scene": self.scene,
            "--run": self.run,
            "--presses": self.presses,
            "--depth": self.depth,
            "--seed": self.seed,
            "--gap": self.gap,
        }
        named = [name for name, value in given.items() if value is not None]
        if named:
            raise WrongUse(f"{', '.join(named)}: {why}")


def chosen(folder: Path | None, wanted: PressRequest) -> None:
    """Refuse anything but one of a folder, a station to move, or a run to go on with."""
    ways = {"FOLDER": folder, "--station": wanted.station, "--resume": wanted.resume}
    given = [name for name, value in ways.items() if value is not None]
    if len(given) != 1:
        raise WrongUse(
            f"{' and '.join(given) or 'nothing'} given; give FOLDER (pictures, or a run that the arm made), "
            "or --station NAME to press a ball with that bench's arm, or --resume RUN to go on with one"
        )
    if wanted.station is None:
        wanted.require_none("they plan a new run of the arm; give --station, or leave them out")


def pressed(wanted: PressRequest, as_json: bool) -> Path | None:
    """The folder of the run that the arm made or went on with; None where Ctrl-C ended it early."""
    from calibration.taxim.arm.session import perform_on_bench

    recording = _recording(wanted)
    total = len(recording.header.plan["steps"])
    if recording.committed < total:
        CONSOLE.print(f"recording to {recording.folder}", markup=False)
        how = f"touchstone calibrate taxim --resume {recording.folder}"
        with resumable(how), _progress(recording.committed, total) as told:
            done = perform_on_bench(recording, told, told.say)
        if not done.complete:
            _stopped(recording, as_json)
            return None
    return recording.folder


def _recording(wanted: PressRequest) -> "Recording":
    from calibration.taxim.arm.record import NAME
    from harness.experiment.lookup import require_of
    from harness.recording.recording import Recording

    if wanted.resume is not None:
        recording = Recording(wanted.resume)
        require_of(recording, NAME, "--resume")
        return recording
    return _begun(wanted)


def _begun(wanted: PressRequest) -> "Recording":
    from calibration.taxim.arm.plan import PressSettings
    from calibration.taxim.arm.session import ball_scene, begin
    from harness.bench.scene import load_scene
    from harness.bench.station_file import load_station, station_path
    from harness.objects.targets import BALL_RADIUS

    scene = None if wanted.scene is None else load_scene(wanted.scene)
    radius = wanted.ball_radius
    if radius is None:
        if scene is None:
            raise WrongUse("--ball-radius is missing: the radius of the ball on the table, as 2mm")
        radius = BALL_RADIUS * scene.object.scale
    usual = PressSettings()
    settings = PressSettings(
        presses=usual.presses if wanted.presses is None else wanted.presses,
        depth=0.4 * radius if wanted.depth is None else wanted.depth,
    )
    station = load_station(station_path(wanted.station or ""))
    seed = 0 if wanted.seed is None else wanted.seed
    with CONSOLE.status("planning the presses, rehearsing them in the twin"):
        begun = begin(ball_scene(radius, scene), station, settings, seed, wanted.gap, wanted.run)
    rehearsal = begun.plan.rehearsal
    CONSOLE.print(
        f"{settings.presses} presses of {1e3 * settings.depth:.2f} mm; rehearsed in the twin: "
        f"{rehearsal.segments} motions, none refused; {len(rehearsal.warnings)} warnings"
    )
    return begun.recording


def _stopped(recording: "Recording", as_json: bool) -> None:
    said = (
        f"stopped after step {recording.committed}; go on with "
        f"`touchstone calibrate taxim --resume {recording.folder}`"
    )
    CONSOLE.print(said, markup=False)
    if as_json:
        emit({"schema": 1, "error": said, "exit_code": 130, "recording": str(recording.folder)})


class _Told:
    """A bar over the steps, and a line for each."""

    def __init__(self, bar: Progress, done: int, total: int) -> None:
        self._bar = bar
        self._total = total
        self._task = bar.add_task("presses", completed=done, total=total)

    def began(self, step: Step) -> None:
        self._bar.update(self._task, description=f"step {step.index + 1}: {step.kind}")

    def ended(self, step: Step, seconds: float) -> None:
        self._bar.advance(self._task)
        self._bar.console.print(f"  step {step.index + 1} of {self._total} on the disk, {seconds:.1f} s")

    def say(self, sentence: str) -> None:
        """How the step that is being made went."""
        self._bar.console.print(f"  {escape(sentence)}")


@contextmanager
def _progress(done: int, total: int) -> Iterator[_Told]:
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=CONSOLE, transient=True) as bar:
        yield _Told(bar, done, total)
