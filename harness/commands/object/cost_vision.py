"""``touchstone cost vision``: what pictures by networks cost and err, knob by knob."""

import math
import os
from collections.abc import Sequence
from datetime import UTC, datetime
from json import dumps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from harness.basics.cores import own_cores
from harness.basics.whole_file import write_text_whole
from harness.commands import options
from harness.commands.object import vision_options
from harness.commands.output import ANSWERS, emit, share_progress, warn

if TYPE_CHECKING:
    from harness.authoring.training import Report
    from harness.authoring.vision.cost import PictureCost, Way
    from harness.authoring.vision.profiles import CellsSpec
    from harness.cost.curve import Point

CODE = "harness.authoring.vision.cost"
"""The module whose sources, with all that it imports, networks and pictures depend on."""


def vision(
    mesh: options.MeshArgument,
    units: options.Units = None,
    profile: Annotated[str, typer.Option(help="Of the networks: smoke or standard.")] = "smoke",
    knob: Annotated[
        list[str] | None,
        typer.Option(help="Only this knob, as coverage; may be given again.", metavar="KNOB"),
    ] = None,
    views: Annotated[int, typer.Option(help="Pictures, from around.", min=1, max=100)] = 4,
    repeat: Annotated[int, typer.Option(help="Times each is drawn for its seconds.", min=1, max=1000)] = 5,
    size: Annotated[int, typer.Option(help="Pixels, a side.", min=16, max=1024)] = 256,
    seed: Annotated[int, typer.Option(help="Of everything random.", min=0)] = 0,
    threads: vision_options.Threads = None,
    out: Annotated[
        Path, typer.Option(help="Folder of networks, curve and picture; what is stopped resumes there.")
    ] = Path("runs/cost/vision"),
    json: options.Json = False,
) -> int:
    """Error against seconds of an object's pictures: every knob turned, all others at their default.

    Knobs of the renderer ask the same networks in other ways; grid, width and what networks are told are
    trained anew, one after the other. Errors are PSNR and SSIM on cameras and lights that nothing was
    learned from, against exact pictures. Leave the machine alone meanwhile: its load is noted.

    Try: touchstone cost vision builtin:wrench --threads 1
    """
    options.require_folders(("--out", out))
    from harness.authoring.vision.cost import Studio, measure
    from harness.authoring.vision.data import held_out_pictures
    from harness.authoring.vision.profiles import vision_profile
    from harness.cost.curve import front
    from harness.cost.provenance import code, machine
    from harness.report.figures.charts import cost_chart
    from harness.report.figures.figures import Album
    from harness.sim.light.appearance_source import appearance_of
    from harness.sim.light.direct_image import LitObject
    from harness.sim.solid.intake import surface_of

    chosen = _chosen(vision_profile(profile).networks, size, knob)
    look = appearance_of(mesh, surface_of(mesh, units, None).units)
    studio = Studio(LitObject(look), held_out_pictures(look.mesh, views, size, size, seed), threads)
    out.mkdir(parents=True, exist_ok=True)
    with share_progress(quiet=json) as report:
        wanted = tuple(dict.fromkeys(way.networks for way in chosen))
        for number, networks in enumerate(wanted, start=1):
            studio.train(networks, seed, out, _after(f"networks {number} of {len(wanted)}", report))
        # Programs that ran or waited over the last minute, this one's single thread left out.
        load = max(os.getloadavg()[0] - 1.0, 0.0) if hasattr(os, "getloadavg") else None
        cores = threads or own_cores()
        costs = measure(chosen, studio, repeat, report)
    of_size = [each.point for each in costs if each.way.side == size]
    best = front(of_size)
    title = f"{Path(mesh).name}, {size} x {size} pixels, {cores} threads"
    chart = cost_chart(of_size, ("knob",), title, stale=False)
    answer = {
        "schema": 2,
        "program": "vision",
        "mesh": mesh,
        "profile": profile,
        "seed": seed,
        "made": datetime.now(UTC).isoformat(timespec="seconds"),
        "machine": machine(),
        "code": code(CODE),
        "threads": cores,
        "repeat": repeat,
        "load": load,
        "points": [_point(each, each.point in best) for each in costs],
        "picture": str(out / Album(out).drawing("curve", chart).file),
        "curve": str(out / "curve.json"),
    }
    write_text_whole(out / "curve.json", dumps(answer, allow_nan=False, indent=1) + "\n")
    if load is not None and load + cores > (os.cpu_count() or 1) + 0.5:
        warn(
            f"the machine was busy (load {load:.1f} before the pictures): seconds on the clock say "
            "nothing; compare CPU time, or measure again when it is quiet"
        )
    if json:
        emit(answer)
    else:
        _print(costs, best)
        ANSWERS.print(answer["picture"], markup=False)
    return 0


def _chosen(spec: "CellsSpec", size: int, knobs: list[str] | None) -> "tuple[Way, ...]":
    from harness.authoring.vision.cost import DEFAULT, ways
    from harness.basics.errors import WrongUse
    from harness.basics.files.named_file import nearest
    from harness.objectfile.vision.render import REMOVED

    every = ways(spec, size)
    known = [way.knob.partition(",")[0] for way in every]
    for name in knobs or []:
        if name in REMOVED:
            raise WrongUse(f"--knob {name}: {REMOVED[name]}; there are {', '.join(dict.fromkeys(known))}")
        if name not in known:
            raise WrongUse(f"no knob {name!r}; {nearest(name, known)}")
    kept = {DEFAULT, *(knobs or known)}
    return tuple(way for way, name in zip(every, known, strict=True) if name in kept)


def _after(before: str, report: "Report") -> "Report":
    return lambda doing, share: report(f"{before}: {doing}", share)


def _point(cost: "PictureCost", on_front: bool) -> dict[str, Any]:
    from harness.cost.file import summary

    worth = cost.worth
    return {
        **summary(cost.point, on_front),
        "wall_s": float(cost.point.wall_seconds.mean()),
        "side_px": cost.way.side,
        "samples": worth.samples,
        "rays": worth.rays,
        "networks": worth.networks,
        "file_bytes": worth.file_bytes,
        # The decibels of equal pictures are null.
        "from_exact": {name: value if math.isfinite(value) else None for name, value in worth.exact.items()},
    }


def _print(costs: "Sequence[PictureCost]", best: "Sequence[Point]") -> None:
    drawn = Table()
    for heading in ("knob", "level"):
        drawn.add_column(heading, no_wrap=True)
    for heading in (*("front", "samples", "exact, dB", "SSIM", "object, dB", "CPU, ms", "clock, ms", "MB"),):
        drawn.add_column(heading, justify="right", no_wrap=True)
    last = ""
    for cost in costs:
        way, worth, exact = cost.way, cost.worth, cost.worth.exact
        if last and way.knob != last:
            drawn.add_section()
        drawn.add_row(
            *("" if way.knob == last else way.knob, way.level, "*" if cost.point in best else ""),
            *(f"{worth.samples:.0f}", f"{exact['psnr_db']:.2f}", f"{exact['ssim']:.4f}"),
            f"{exact['psnr_db_object']:.2f}",
            *(f"{1e3 * cost.point.seconds.value:.1f}", f"{1e3 * cost.point.wall_seconds.mean():.1f}"),
            f"{worth.file_bytes / 1e6:.2f}",
        )
        last = way.knob
    ANSWERS.print(drawn)
