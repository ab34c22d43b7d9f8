"""The part of ``touchstone calibrate taxim`` that moves the arm: plan, press, say how it goes."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from harness.basics.errors import WrongUse
from harness.commands.output import CONSOLE, resumable, step_progress, stopped

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
    bench: str | None

    def require_none(self) -> None:
        """Refuse options that only a new run of the arm can follow."""
        names = ("scene", "run", "presses", "depth", "seed", "gap", "bench")
        named = [f"--{name}" for name in names if vars(self)[name] is not None]
        if named:
            raise WrongUse(
                f"{', '.join(named)}: they plan a new run of the arm; give --station, or leave them out"
            )


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
        wanted.require_none()


def pressed(wanted: PressRequest, as_json: bool) -> Path | None:
    """The folder of the run that the arm made or went on with; None where Ctrl-C ended it early."""
    from calibration.taxim.arm.session import procedure
    from harness.experiment.perform import describe_bench, perform_on_bench, steps_planned

    recording, presses = _recording(wanted), procedure()
    total = steps_planned(presses, recording)
    if recording.committed < total:
        CONSOLE.print(f"bench: {describe_bench(recording)}", markup=False)
        CONSOLE.print(f"recording to {recording.folder}", markup=False)
        how = f"touchstone calibrate taxim --resume {recording.folder}"
        with (
            recording.hold(),
            resumable(how),
            step_progress(recording.committed, total, presses.step) as told,
        ):
            done = perform_on_bench(presses, recording, told, say=told.say)
        if not done.complete:
            stopped(f"{presses.step} {recording.committed}", recording.folder, how, as_json)
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
    from calibration.taxim.arm.session import ball_scene, procedure
    from harness.bench.scene import load_scene
    from harness.bench.station_file import load_station, station_path
    from harness.experiment.begin import begin
    from harness.objects.targets import BALL_RADIUS

    scene = None if wanted.scene is None else load_scene(wanted.scene)
    radius = wanted.ball_radius
    if radius is None:
        if scene is None:
            raise WrongUse("--ball-radius is missing: the radius of the ball on the table, as 2mm")
        radius = BALL_RADIUS * scene.object.drawn_scale
    usual = PressSettings()
    settings = PressSettings(
        presses=usual.presses if wanted.presses is None else wanted.presses,
        depth=0.4 * radius if wanted.depth is None else wanted.depth,
    )
    station = load_station(station_path(wanted.station or ""))
    with CONSOLE.status("planning the presses, rehearsing them in the twin"):
        begun = begin(
            procedure(settings),
            ball_scene(radius, scene),
            station,
            wanted.seed,
            wanted.gap,
            wanted.run,
            wanted.bench,
        )
    rehearsal = begun.plan.rehearsal
    CONSOLE.print(
        f"{settings.presses} presses of {1e3 * settings.depth:.2f} mm; rehearsed in the twin: "
        f"{rehearsal.segments} motions, none refused; {len(rehearsal.warnings)} warnings"
    )
    return begun.recording
