"""``touchstone object build``: from a mesh to an ObjectFile."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from harness.commands import options
from harness.commands.object.build_answer import build_and_say
from harness.commands.output import ANSWERS

if TYPE_CHECKING:
    from harness.authoring.audio.object_audio import AudioRequest, BuiltAudio

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
            help="smoke, shipped (of the fewest bytes) or standard (no torch), small (of audio), or paper: "
            "networks of its size."
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
            help="Of a training: 1, and as many as cores for vision; a resumed one of sound or touch "
            "ends in the same bits with 1.",
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
    finish: Annotated[
        bool,
        typer.Option("--finish", help="Of vision: let it learn from pictures last; paper does anyway."),
    ] = False,
    json: options.Json = False,
) -> int:
    """Build an object's sound, touch or look: networks, and their errors where they never looked.

    Sound: a tenth of the nodes is held out. Errors there stand beside those of the nearest trained vertex,
    of linear interpolation, and of a float16 table at its own nodes. A stopped build goes on when it is
    called again: solved modes are kept in the cache, a training in the folder.

    Touch: the surface is coded, and its maps of presses that were never shown are compared with the
    simulator's (PSNR of 2 mm), beside the nearest coded place's and an untouched gel. --up-to, --modes and
    --edge are of sound alone.

    Vision: tiny networks of the file's own colours, as the mesh's texture says them, measured on pictures
    whose cameras and lights were kept back. A stopped training goes on when it is called again. --finish
    is for what no place of the surface tells by itself, as shadows to networks that are told no visibility.

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
    if finish and only != "vision":
        raise WrongUse(f"--finish is of vision, and --only {only} was asked for")
    if sensor is not None and only != "touch":
        raise WrongUse(f"--sensor is of touch, and --only {only} was asked for")
    thick = options.quantity("--wall", wall, LENGTH)
    wanted = PartRequest(mesh, named(material), profile, units, thick, licence, seed, up_axis)
    limit, longest = options.quantity("--up-to", up_to, FREQUENCY), options.quantity("--edge", edge, LENGTH)
    with hold_folder(out):
        if only == "touch":
            from harness.commands.object.build_touch import build_touch_part

            return build_touch_part(wanted, sensor, out, threads or 1, json)
        if only == "vision":
            from harness.commands.object.build_vision import build_vision_part

            return build_vision_part(wanted, out, threads, json, finish)
        from harness.authoring.audio.object_audio import AudioRequest

        return _build_audio_part(
            AudioRequest(**vars(wanted), limit=limit, most=modes, edge=longest), out, threads or 1, json
        )


def _build_audio_part(wanted: "AudioRequest", out: Path, threads: int, json: bool) -> int:
    from harness.authoring.audio.object_audio import build_audio
    from harness.basics.store import Store, default_folder

    store = Store(default_folder())
    return build_and_say(
        lambda report: build_audio(wanted, out, store, report, threads), _as_json, _print, json
    )


def _as_json(built: "BuiltAudio") -> dict[str, Any]:
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


def _print(built: "BuiltAudio") -> None:
    audio, modes = built.audio, built.modes
    drawn = Table(
        title=f"{built.object.folder}: {len(modes.frequencies)} modes, "
        f"{len(audio.split.held_out)} of {len(modes.points)} vertices held out"
    )
    for heading in ("shapes from", "gain error", "95th", "STFT e-5", "envelope e-4", "spectrum dB", "MB"):
        drawn.add_column(heading, no_wrap=True)
    for name, errors in audio.errors.items():
        drawn.add_row(_ROWS[name], *_cells(errors))
    ANSWERS.print(drawn)
    _print_seconds(built.seconds)


def _print_seconds(seconds: Mapping[str, float]) -> None:
    from harness.sim.modal.stage_seconds import cpu, wall

    stages = {**wall(seconds), "together": sum(wall(seconds).values())}
    worked = {**cpu(seconds), "together": sum(cpu(seconds).values())}
    drawn = Table(*stages, title="seconds, and below them those of the processor")
    for row in (stages, worked):
        drawn.add_row(*(f"{row[stage]:.1f}" for stage in stages))
    ANSWERS.print(drawn)


def _cells(errors: Mapping[str, float]) -> list[str]:
    scales = {
        "gain_error_median": ("{:.2f} %", 1e2),
        "gain_error_p95": ("{:.2f} %", 1e2),
        "stft_distance": ("{:.3g}", 1e5),
        "envelope_distance": ("{:.3g}", 1e4),
        "spectral_error_db": ("{:.1f}", 1.0),
        "bytes": ("{:.2f}", 1e-6),
    }
    return [
        form.format(errors[name] * scale) if name in errors else "" for name, (form, scale) in scales.items()
    ]
