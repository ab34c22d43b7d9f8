"""``touchstone calibrate taxim``: a tactile camera from ball presses, by the arm or in pictures."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, get_args

import typer

from harness.basics.errors import WrongUse
from harness.commands import options
from harness.commands.output import CONSOLE, print_result, print_stop

if TYPE_CHECKING:
    from calibration.taxim.pictures import Channels
    from harness.recording.recording import Recording


def taxim(
    folder: Annotated[
        Path | None,
        typer.Argument(
            help="Pictures of one ball pressed all over the gel, one a press; a dataPack.npz; or the folder "
            "of a run that the arm made, which is read again without it.",
            metavar="FOLDER",
        ),
    ] = None,
    station: Annotated[
        str | None,
        typer.Option(
            help="Press the ball with the arm of this bench: a name or a file.",
            metavar="NAME",
            callback=options.check_station,
        ),
    ] = None,
    ball_radius: Annotated[
        str | None,
        typer.Option(
            "--ball-radius",
            help="Radius (not diameter) of the ball, as 2mm; a run of the arm has it in its folder.",
            metavar="LENGTH",
        ),
    ] = None,
    pitch: Annotated[
        str | None,
        typer.Option(
            help="Length of gel that a pixel shows, as 0.0295mm. Presses cannot tell it, the arm can: "
            "what it measured if left out. Of pictures that of --sensor, else of the GelSight R1.5.",
            metavar="LENGTH",
        ),
    ] = None,
    aspect: Annotated[
        float | None,
        typer.Option(
            help="A pixel's height over its width: pictures are made square by it, the pitch is that of a "
            "square pixel of the same area. What the arm measured if left out, or 1 of pictures.",
            metavar="RATIO",
        ),
    ] = None,
    scene: Annotated[
        Path | None,
        typer.Option(
            help="Where the ball stands, as scenes/ball_target.toml; its top to 1.5 mm in height.",
            metavar="FILE",
            callback=options.check_scene,
        ),
    ] = None,
    presses: Annotated[
        int | None, typer.Option(help="How many presses the arm makes; 49 if left out.", metavar="N")
    ] = None,
    depth: Annotated[
        str | None,
        typer.Option(
            help="How deep, from where the picture first shows the ball; 0.4 radii if left out.",
            metavar="LENGTH",
        ),
    ] = None,
    run: Annotated[
        Path | None,
        typer.Option(help="Folder of the arm's run; a dated one under runs/ if left out.", metavar="DIR"),
    ] = None,
    resume: Annotated[
        Path | None,
        typer.Option(
            help="Continue this run of the arm at its first missing press.",
            metavar="RUN",
            callback=options.check_run,
        ),
    ] = None,
    seed: Annotated[
        int | None, typer.Option(help="Of the places, and of a mocked world; 0 if left out.", min=0)
    ] = None,
    gap: Annotated[
        str | None,
        typer.Option(help="Reality gap of a mocked bench; target if left out.", metavar="NAME"),
    ] = None,
    bench: options.BenchOption = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="The artefact to write; FOLDER_calibration.npz, or fitted.npz in a run of the arm, if "
            "left out.",
            metavar="FILE",
        ),
    ] = None,
    polycalib: Annotated[
        Path | None,
        typer.Option(help="Write the colour table in Taxim's own layout too.", metavar="FILE"),
    ] = None,
    shadow_table: Annotated[
        Path | None,
        typer.Option(
            "--shadow-table",
            help="Write the shadows in Taxim's own layout too, where the presses show any.",
            metavar="FILE",
        ),
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option(
            help="Write a page with pictures into this folder; of a run of the arm always, into its report/.",
            metavar="DIR",
        ),
    ] = None,
    background: Annotated[
        Path | None,
        typer.Option(
            help="Picture of the untouched gel; found by its name in the folder, or made of the presses.",
            metavar="FILE",
        ),
    ] = None,
    channels: Annotated[
        str | None,
        typer.Option(
            help="Order of the colours in the files, rgb or bgr; by default as the formats say.",
            metavar="ORDER",
        ),
    ] = None,
    like: Annotated[
        Path | None,
        typer.Option(
            help="A calibration of the same make, mounted alike: the order of the colours is held to it.",
            metavar="FILE",
        ),
    ] = None,
    marks: Annotated[
        bool, typer.Option("--marks", help="Start from the circles that came with a data pack.")
    ] = False,
    sensor: Annotated[
        str | None,
        typer.Option(
            help="Sensor: a shipped name or a sensor file, whose pitch and name are used, or any other name. "
            "A run of the arm knows it.",
            metavar="NAME",
        ),
    ] = None,
    serial: Annotated[str, typer.Option(help="Of the very sensor.", metavar="NAME")] = "unknown",
    licence: Annotated[str, typer.Option(help="Of the pictures.", metavar="NAME")] = "not stated",
    json: options.Json = False,
) -> int:
    """Calibrate a tactile camera by pressing its gel on one ball all over. Nobody marks anything.

    With --station the arm does it: screw the ball down where --scene says, and let it press. The motion is
    rehearsed in the twin first; a picture counts when it has come to rest; the untouched gel is looked at
    before each press, and a changed light stops the run with the reason. Each press is on the disk before the
    next begins: Ctrl-C once ends after the press, twice stops the arm, --resume goes on.

    From the arm's known moves come millimetres per pixel, aspect and rotation of the picture, each with its
    error. Pictures alone cannot give these: they are said to be missing, and the pitch is taken as given.

    Presses are found, damaged ones refused with the reason, colours and centres fitted in turns, and the
    result scored on presses held out of the fit: eight folds, only the centre refitted on a held-out press.

    Try: touchstone calibrate taxim --station mock --ball-radius 2mm --run runs/r15

    Then: touchstone calibrate taxim runs/r15        (again, without the arm)

    Or: touchstone calibrate taxim presses/ --ball-radius 2mm --pitch 0.1245mm --report page/
    """
    from harness import api
    from harness.basics.quantities import LENGTH
    from harness.tasks.runs import RunStopped

    options.require_files(
        ("--out", out, ""), ("--polycalib", polycalib, ""), ("--shadow-table", shadow_table, "")
    )
    options.require_folders(("--report", report), ("--run", run))
    wanted = PressRequest(
        station,
        scene,
        resume,
        run,
        presses,
        options.positive("--depth", depth, LENGTH),
        options.positive("--ball-radius", ball_radius, LENGTH),
        seed,
        gap,
        bench,
    )
    chosen(folder, wanted)
    try:
        source = folder if folder is not None else perform_presses(wanted, json)
    except RunStopped as stop:
        return print_stop(stop, stop.folder, json)
    calibrated = api.calibrate_taxim(
        source,
        ball_radius=wanted.ball_radius,
        pitch=options.positive("--pitch", pitch, LENGTH),
        aspect=aspect,
        sensor=sensor,
        serial=serial,
        licence=licence,
        background=background,
        channels=_channels(channels),
        like=like,
        use_marks=marks,
        out=out,
        polycalib=polycalib,
        shadow_table=shadow_table,
        report=report,
    )
    print_result(calibrated, json)
    return 0


def _channels(text: str | None) -> "Channels | None":
    from calibration.taxim.pictures import Channels
    from harness.basics.errors import WrongUse

    if text is None:
        return None
    for order in get_args(Channels):
        if text == order:
            known: Channels = order
            return known
    raise WrongUse(f"--channels: no order {text!r}; there are {' and '.join(get_args(Channels))}")


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
            "or --station NAME to press a ball with that bench's arm, or --resume RUN to resume a run"
        )
    if wanted.station is None:
        wanted.require_none()


def perform_presses(wanted: PressRequest, as_json: bool) -> Path:
    """Press with the arm, or resume a run, and return its folder; ``RunStopped`` if Ctrl-C ended it."""
    from calibration.taxim.arm.press import procedure
    from calibration.taxim.arm.record import NAME
    from harness.commands.run.watcher import TerminalWatcher
    from harness.experiment.lookup import require_of
    from harness.recording.recording import Recording
    from harness.recording.run_folder import RunFiles
    from harness.tasks.runs import perform_run

    if wanted.resume is None:
        recording = _begun(wanted)
    else:
        recording = Recording(wanted.resume)
        require_of(recording, NAME, "--resume")
    how = f"touchstone calibrate taxim --resume {recording.folder}"
    with recording.hold():
        perform_run(procedure(), RunFiles(recording), how, TerminalWatcher(as_json))
    return recording.folder


def _begun(wanted: PressRequest) -> "Recording":
    from calibration.taxim.arm.plan import PressSettings
    from calibration.taxim.arm.press import ball_scene, procedure
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
