"""``touchstone object build``: from a mesh to an ObjectFile."""

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Protocol, TypeVar

import typer
from rich.table import Table

from harness.commands import options
from harness.commands.output import ANSWERS, emit, share_progress, warn

if TYPE_CHECKING:
    from harness.authoring.audio.object_audio import BuiltAudio
    from harness.authoring.touch.object_touch import BuiltTouch
    from harness.authoring.vision.object_vision import BuiltVision
    from harness.objectfile.vision_entry import VisionEntry


_ROWS = {
    "network": "network",
    "nearest_trained": "nearest trained vertex",
    "linear": "linear on the surface",
    "table_float16": "float16 table, at its nodes",
}


def build(
    mesh: options.MeshArgument,
    out: Annotated[Path, typer.Option(help="The ObjectFile's folder.", metavar="FOLDER")],
    material: Annotated[str, typer.Option(help="What it is made of.", metavar="M")],
    only: Annotated[str, typer.Option(help="Which modality: audio, touch or vision.")] = "audio",
    profile: Annotated[
        str,
        typer.Option(
            help="smoke, shipped (of the fewest bytes), standard, or, of vision, paper: networks of its size."
        ),
    ] = "standard",
    units: Annotated[
        str | None, typer.Option(help="Of the file's numbers: m, cm, mm, um, in or ft.", metavar="U")
    ] = None,
    up_axis: options.UpAxis = None,
    wall: Annotated[
        str | None,
        typer.Option(help="Wall of a hollow thing of which the file is the outside, as 2mm.", metavar="L"),
    ] = None,
    up_to: options.UpTo = "20kHz",
    modes: options.MostModes = 128,
    edge: options.LongestEdge = None,
    licence: Annotated[str, typer.Option(help="Of the mesh, and so of the ObjectFile.")] = "unknown",
    seed: Annotated[int, typer.Option(help="Of everything random.", min=0)] = 0,
    threads: Annotated[
        int | None,
        typer.Option(
            help="Of the fit or training: 1, and as many as cores for vision.",
            min=1,
        ),
    ] = None,
    sensor: Annotated[
        str | None,
        typer.Option(
            help="Of touch: the make that presses, by its name, gelsight-r1.5 if left out, or the path of a "
            "sensor's own file.",
            metavar="NAME",
        ),
    ] = None,
    json: options.Json = False,
) -> int:
    """Build an object's sound, touch or look: networks, and their errors where they never looked.

    Sound: a tenth of the nodes is held out. Errors there stand beside those of the nearest trained vertex,
    of linear interpolation, and of a float16 table at its own nodes. A stopped build goes on when it is
    called again: solved modes are kept in the cache.

    Touch: the surface is coded, and its maps of presses that were never shown are compared with the
    simulator's (PSNR of 2 mm), beside the nearest coded place's and an untouched gel. --up-to, --modes and
    --edge are of sound alone.

    Vision: tiny networks of the file's own colours, as the mesh's texture says them, measured on pictures
    whose cameras and lights were kept back. A stopped training goes on when it is called again.

    Try: touchstone object build builtin:bowl --material ceramic --profile smoke --out my/bowl
    """
    options.require_folders(("--out", out))
    from harness.authoring.object_source import PartRequest
    from harness.basics.errors import WrongUse
    from harness.basics.files.lock_file import hold_folder
    from harness.basics.materials import material as named
    from harness.basics.quantities import FREQUENCY, LENGTH

    if only not in ("audio", "touch", "vision"):
        raise WrongUse(f"--only {only} cannot be built; there is audio, touch and vision")
    if sensor is not None and only != "touch":
        raise WrongUse(f"--sensor is of touch, and --only {only} was asked for")
    thick = options.quantity("--wall", wall, LENGTH)
    wanted = PartRequest(mesh, named(material), profile, units, thick, licence, seed, up_axis)
    limit, longest = options.quantity("--up-to", up_to, FREQUENCY), options.quantity("--edge", edge, LENGTH)
    with hold_folder(out):
        if only == "touch":
            from harness.authoring.touch.object_touch import TouchRequest, build_touch
            from harness.bench.sensor import DEFAULT_MAKE, described_sensor

            touch = TouchRequest(**vars(wanted), sensor=described_sensor(sensor or DEFAULT_MAKE).sensor)
            return build_and_print(
                lambda report: build_touch(touch, out, report, threads or 1), _touch_json, _print_touch, json
            )
        if only == "vision":
            from harness.authoring.vision.object_vision import build_vision

            return build_and_print(
                lambda report: build_vision(wanted, out, report, threads),
                _vision_json,
                _print_vision,
                json,
            )
        from harness.authoring.audio.object_audio import AudioRequest, build_audio
        from harness.basics.store import Store, default_folder

        audio = AudioRequest(**vars(wanted), limit=limit, most=modes, edge=longest)
        store = Store(default_folder())
        return build_and_print(
            lambda report: build_audio(audio, out, store, report, threads or 1),
            _audio_json,
            _print_audio,
            json,
        )


def _audio_json(built: "BuiltAudio") -> dict[str, Any]:
    from harness.sim.modal.stage_seconds import cpu, wall

    audio, modes = built.audio, built.modes
    entry = built.object.description.audio
    assert entry is not None
    return {
        "schema": 1,
        "folder": str(built.object.folder),
        "frequencies_hz": modes.frequencies.tolist(),
        "dampings_per_s": list(entry.dampings_per_s),
        "unknowns": 3 * modes.nodes,
        "vertices": len(modes.points),
        "held_out": len(audio.split.held_out),
        "settings": dict(audio.settings),
        "errors": {name: dict(errors) for name, errors in audio.errors.items()},
        "seconds": wall(built.seconds),
        "cpu_seconds": cpu(built.seconds),
    }


def _print_audio(built: "BuiltAudio") -> None:
    from harness.sim.modal.stage_seconds import cpu, wall

    audio, modes = built.audio, built.modes
    drawn = Table(
        title=f"{built.object.folder}: {len(modes.frequencies)} modes, "
        f"{len(audio.split.held_out)} of {len(modes.points)} vertices held out"
    )
    columns = {
        "gain_error_median": ("gain error", "{:.2f} %", 1e2),
        "gain_error_p95": ("95th", "{:.2f} %", 1e2),
        "stft_distance": ("STFT e-5", "{:.3g}", 1e5),
        "envelope_distance": ("envelope e-4", "{:.3g}", 1e4),
        "spectral_error_db": ("spectrum dB", "{:.1f}", 1.0),
        "bytes": ("MB", "{:.2f}", 1e-6),
    }
    for heading in ("shapes from", *(heading for heading, _, _ in columns.values())):
        drawn.add_column(heading, no_wrap=True)
    for name, errors in audio.errors.items():
        cells = (
            form.format(errors[key] * scale) if key in errors else ""
            for key, (_, form, scale) in columns.items()
        )
        drawn.add_row(_ROWS[name], *cells)
    ANSWERS.print(drawn)
    stages = {**wall(built.seconds), "together": sum(wall(built.seconds).values())}
    worked = {**cpu(built.seconds), "together": sum(cpu(built.seconds).values())}
    drawn = Table(*stages, title="seconds, and below them those of the processor")
    for row in (stages, worked):
        drawn.add_row(*(f"{row[stage]:.1f}" for stage in stages))
    ANSWERS.print(drawn)


class Built(Protocol):
    """What a builder gives back."""

    @property
    def said(self) -> tuple[str, ...]:
        """What was done to the mesh and what to look at, a sentence each."""


Part = TypeVar("Part", bound=Built)


def build_and_print(
    builder: Callable[[Callable[[str, float], None]], Part],
    as_json: Callable[[Part], Mapping[str, Any]],
    show: Callable[[Part], None],
    json: bool,
) -> int:
    """Build under a bar of progress, say what to look at, and answer.

    Args:
        builder: of the part; handed what it is to tell of its progress.
        as_json: the answer for scripts.
        show: the answer for people.
        json: whether the answer is for scripts.
    """
    with share_progress(quiet=json) as report:
        built = builder(report)
    for sentence in built.said:
        warn(sentence)
    if json:
        emit(as_json(built))
    else:
        show(built)
    return 0


_KINDS = {"trained_places": "trained places", "unseen_places": "unseen places", "any_press": "any press"}


_TOUCH_ROWS = {"level": "codes", "nearest_trained": "nearest trained place", "background": "untouched gel"}


def _touch_json(built: "BuiltTouch") -> dict[str, Any]:
    touch = built.touch
    errors = {kind: {name: dict(row) for name, row in rows.items()} for kind, rows in touch.errors.items()}
    return {
        "schema": 1,
        "folder": str(built.object.folder),
        "nodes": len(touch.codes.nodes),
        "settings": dict(touch.settings),
        "errors": errors,
        "measured": dict(touch.codes.measured),
        "bytes": sum(entry.bytes for entry in _touch_entry(built).files),
        "seconds": dict(built.seconds),
    }


def _touch_entry(built: "BuiltTouch") -> Any:
    entry = built.object.description.touch
    assert entry is not None
    return entry


def _print_touch(built: "BuiltTouch") -> None:
    touch = built.touch
    size = sum(entry.bytes for entry in _touch_entry(built).files) / 1e6
    drawn = Table(title=f"{built.object.folder}: {len(touch.codes.nodes)} coded places, {size:.1f} MB")
    for heading in ("presses at", "maps from", "PSNR dB, median", "10th percentile", "possible of asked"):
        drawn.add_column(heading, no_wrap=True)
    for kind, rows in touch.errors.items():
        counts = rows["presses"]
        for name, said in _TOUCH_ROWS.items():
            row = rows[name]
            cells = f"{row['psnr_db_median']:.1f}", f"{row['psnr_db_p10']:.1f}"
            drawn.add_row(_KINDS[kind], said, *cells, f"{counts['possible']:.0f} of {counts['asked']:.0f}")
    ANSWERS.print(drawn)
    said = ", ".join(f"{stage} {seconds:.1f} s" for stage, seconds in built.seconds.items())
    ANSWERS.print(said, markup=False)


def _vision_json(built: "BuiltVision") -> dict[str, Any]:
    """As scripts read it; an error without a number, as the decibels of equal pictures, is null."""
    entry = _vision_entry(built)
    return {
        "schema": 1,
        "folder": str(built.object.folder),
        "level": entry.level,
        "networks": entry.grid.networks,
        "cell_m": entry.grid.cell_m,
        "width": entry.size.width,
        "settings": dict(built.vision.settings),
        "errors": {
            name: value if math.isfinite(value) else None for name, value in built.vision.errors.items()
        },
        "bytes": sum(file.bytes for file in entry.files),
        "seconds": dict(built.seconds),
        "seconds_in_all": sum(built.seconds.values()),
    }


def _print_vision(built: "BuiltVision") -> None:
    """For people: a table of what was measured on pictures never trained on, and of seconds."""
    entry = _vision_entry(built)
    size = sum(file.bytes for file in entry.files) / 1e6
    networks = f"{entry.grid.networks} networks {entry.size.width} wide, {entry.level}"
    drawn = Table(title=f"{built.object.folder}: {networks}, {size:.1f} MB")
    drawn.add_column("on pictures never trained on", no_wrap=True)
    drawn.add_column("measured", justify="right", no_wrap=True)
    for name, value in built.vision.errors.items():
        drawn.add_row(name.replace("_", " "), f"{value:.4g}")
    drawn.add_section()
    for stage, seconds in built.seconds.items():
        drawn.add_row(f"seconds: {stage}", f"{seconds:.1f}")
    drawn.add_row("seconds in all", f"{sum(built.seconds.values()):.1f}")
    ANSWERS.print(drawn)


def _vision_entry(built: "BuiltVision") -> "VisionEntry":
    entry = built.object.description.vision
    assert entry is not None
    return entry
