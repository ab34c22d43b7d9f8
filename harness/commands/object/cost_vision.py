"""``touchstone cost vision``: what pictures by networks cost and err, knob by knob."""

import time
from dataclasses import dataclass
from json import dumps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from harness.basics.whole_file import write_text_whole
from harness.commands import options
from harness.commands.object import vision_options
from harness.commands.object.cost_vision_answer import (
    MeasuredCurves,
    as_json,
    draw,
    load_of_others,
    print_answer,
)
from harness.commands.output import emit, share_progress, warn

if TYPE_CHECKING:
    from harness.authoring.training import Report
    from harness.authoring.vision.cost import Views
    from harness.authoring.vision.profiles import CellsSpec
    from harness.authoring.vision.trades import Trade


def vision(
    mesh: Annotated[str, typer.Argument(help="A mesh file, or builtin:mug and so on.", metavar="MESH")],
    units: Annotated[
        str | None, typer.Option(help="Of the file's numbers: m, cm, mm or in.", metavar="U")
    ] = None,
    profile: Annotated[str, typer.Option(help="Of the networks: smoke or standard.")] = "smoke",
    knob: Annotated[
        list[str] | None,
        typer.Option(help="Only this knob, as termination; may be given again.", metavar="KNOB"),
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
    learned from, against exact pictures and against many samples of the same networks. Leave the machine
    alone meanwhile: its load is noted.

    Try: touchstone cost vision builtin:wrench --threads 1
    """
    from harness.authoring.vision.cost import Views
    from harness.authoring.vision.data import held_out_pictures
    from harness.authoring.vision.profiles import vision_profile
    from harness.sim.light.appearance_source import appearance_of
    from harness.sim.light.direct_image import LitObject
    from harness.sim.solid.surface_source import surface_of

    spec = vision_profile(profile).networks
    chosen = _chosen(spec, size, knob)
    look = appearance_of(mesh, surface_of(mesh, units, None).units)
    sight = Views(LitObject(look), held_out_pictures(look.mesh, views, size, size, seed))
    out.mkdir(parents=True, exist_ok=True)
    with share_progress() as report:
        found = _measured(chosen, sight, _Asking(seed, repeat, out, threads), report)
    picture = draw(found, mesh, out)
    answer = as_json(found, mesh, profile, seed, picture)
    write_text_whole(picture.with_suffix(".json"), dumps(answer, allow_nan=False, indent=1) + "\n")
    for sentence in found.notes:
        warn(sentence)
    if json:
        emit(answer)
    else:
        print_answer(found, picture)
    return 0


@dataclass(frozen=True)
class _Asking:
    """How networks are made and pictures timed."""

    seed: int
    repeat: int
    out: Path
    threads: int | None


def _measured(
    chosen: "tuple[Trade, ...]", sight: "Views", asking: _Asking, report: "Report"
) -> MeasuredCurves:
    from harness.authoring.vision.cost import CostRequest, measured, networks_of
    from harness.authoring.vision.cost_networks import trained

    begun, models = time.perf_counter(), {}
    for number, networks in enumerate(wanted := networks_of(chosen)):
        named = _numbered(report, f"networks {number + 1} of {len(wanted)}")
        models[networks] = trained(networks, sight, asking.seed, asking.out, named, asking.threads)
    seconds = {"networks": time.perf_counter() - begun}
    before = load_of_others()
    begun = time.perf_counter()
    asked, ways = CostRequest(models, sight.lit, asking.threads), [each.way for each in chosen]
    costs = measured(ways, asked, sight, asking.repeat, report)
    seconds["pictures"] = time.perf_counter() - begun
    return MeasuredCurves(chosen, costs, asked.threads, asking.repeat, before, seconds)


def _chosen(spec: "CellsSpec", size: int, knobs: list[str] | None) -> "tuple[Trade, ...]":
    from harness.authoring.vision.trades import trades
    from harness.basics.errors import WrongUse
    from harness.basics.toml_file import nearest

    every = trades(spec, size)
    known = {each.knob.partition(",")[0]: each.knob for each in every}
    for name in knobs or []:
        if name not in known:
            raise WrongUse(f"no knob {name!r}; {nearest(name, known)}")
    kept = {known[name] for name in knobs or known}
    return tuple(each for each in every if each.knob in kept)


def _numbered(report: "Report", before: str) -> "Report":
    return lambda doing, share: report(f"{before}: {doing}", share)
