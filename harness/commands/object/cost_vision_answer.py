"""What ``touchstone cost vision`` answers: a picture of curves, one JSON object, or a table for people."""

import math
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.table import Table

from harness.commands.output import ANSWERS

if TYPE_CHECKING:
    from harness.authoring.vision.cost import Cost
    from harness.authoring.vision.trades import Trade, Variation

CODE = "harness.authoring.vision.cost_networks"
"""The module whose sources, with all that it imports, networks and pictures depend on."""

_BITS = "weights, bits"
"""The knob whose cost is the file's size: pictures take the same time."""


@dataclass(frozen=True, eq=False)
class MeasuredCurves:
    """Curves and how they came about.

    Attributes:
        trades: every knob at every level.
        costs: of each way.
        threads: that shared the work; None for as many as the process has cores.
        repeat: times that each picture was drawn.
        load: of the machine before the pictures, programs that ran or waited; None where it says none.
        seconds: s on the clock of networks and pictures.
    """

    trades: "tuple[Trade, ...]"
    costs: "Mapping[Variation, Cost]"
    threads: int | None
    repeat: int
    load: float | None
    seconds: Mapping[str, float]

    @property
    def cores(self) -> int:
        """That shared the work."""
        from harness.basics.cores import own_cores

        return own_cores() if self.threads is None else self.threads

    @property
    def notes(self) -> tuple[str, ...]:
        """What the operator should know."""
        if self.load is None or self.load + self.cores <= (os.cpu_count() or 1) + 0.5:
            return ()
        return (
            f"the machine was busy (load {self.load:.1f} before the pictures): seconds on the clock say "
            "nothing; compare CPU time, or measure again when it is quiet",
        )


def load_of_others() -> float | None:
    """Programs that ran or waited over the last minute, this one's single thread left out."""
    return max(os.getloadavg()[0] - 1.0, 0.0) if hasattr(os, "getloadavg") else None


def draw(found: MeasuredCurves, mesh: str, out: Path) -> Path:
    """Write the picture of all curves."""
    from harness.report.figures.figures import Album
    from harness.report.figures.vision_cost import vision_cost_figure

    panels = [_panel(found, knob) for knob in dict.fromkeys(each.knob for each in found.trades)]
    title = f"What a picture of {Path(mesh).name} costs and errs ({_threads(found)}, CPU time of all)"
    return out / Album(out).drawing("curve", vision_cost_figure(panels, title)).file


def _panel(found: MeasuredCurves, knob: str) -> Any:
    from harness.report.figures.vision_cost import LevelMark, Panel

    def cost(of: "Cost") -> float:
        return of.worth.weight_bytes / 1e6 if knob == _BITS else 1e3 * of.cpu.middle

    rows = [(each.level, found.costs[each.way]) for each in found.trades if each.knob == knob]
    marks = [
        LevelMark(level, cost(of), of.worth.exact["psnr_db"], of.worth.many["psnr_db"]) for level, of in rows
    ]
    return Panel(knob, "MB of weights" if knob == _BITS else "ms of CPU time a picture", tuple(marks))


def as_json(found: MeasuredCurves, mesh: str, profile: str, seed: int, picture: Path) -> dict[str, Any]:
    """As scripts read it; the decibels of equal pictures are null."""
    from harness.cost.provenance import code, machine

    return {
        "schema": 1,
        "program": "vision",
        "mesh": mesh,
        "profile": profile,
        "seed": seed,
        "made": datetime.now(UTC).isoformat(timespec="seconds"),
        "machine": machine(),
        "code": code(CODE),
        "threads": found.cores,
        "repeat": found.repeat,
        "load": found.load,
        "notes": list(found.notes),
        "points": [_point(each, found.costs[each.way]) for each in found.trades],
        "seconds": dict(found.seconds),
        "picture": str(picture),
        "curve": str(picture.with_suffix(".json")),
    }


def _point(trade: "Trade", cost: "Cost") -> dict[str, Any]:
    worth, settings = cost.worth, trade.way.settings
    return {
        "knob": trade.knob,
        "level": trade.level,
        "side_px": trade.way.side,
        "samples": worth.samples,
        "rays": worth.rays,
        "samples_per_ray": worth.samples / max(worth.rays, 1.0),
        "networks": worth.networks,
        "weight_bytes": worth.weight_bytes,
        "from_exact": _finite(worth.exact),
        "from_many_samples": _finite(worth.many),
        "wall_s": asdict(cost.wall),
        "cpu_s": asdict(cost.cpu),
        "renderer_level": settings.level,
    }


def _finite(errors: Mapping[str, float]) -> dict[str, float | None]:
    return {name: value if math.isfinite(value) else None for name, value in errors.items()}


def print_answer(found: MeasuredCurves, picture: Path) -> None:
    """For people: a table of every knob."""
    drawn = Table(title=f"{_threads(found)}, {found.repeat} times each; load before {_said(found.load)}")
    for heading in (
        *("knob", "level", "samples", "exact, dB", "SSIM", "object, dB", "many, dB", "CPU, ms", "clock, ms"),
        "MB",
    ):
        drawn.add_column(heading, justify="left" if heading in ("knob", "level") else "right", no_wrap=True)
    last = ""
    for each in found.trades:
        if last and each.knob != last:
            drawn.add_section()
        drawn.add_row("" if each.knob == last else each.knob, each.level, *_cells(found.costs[each.way]))
        last = each.knob
    ANSWERS.print(drawn)
    ANSWERS.print(str(picture), markup=False)


def _cells(cost: "Cost") -> tuple[str, ...]:
    worth, exact = cost.worth, cost.worth.exact
    return (
        *(f"{worth.samples:.0f}", f"{exact['psnr_db']:.2f}", f"{exact['ssim']:.4f}"),
        *(f"{exact['psnr_db_object']:.2f}", f"{worth.many['psnr_db']:.2f}"),
        *(f"{1e3 * cost.cpu.middle:.1f}", f"{1e3 * cost.wall.middle:.1f}", f"{worth.weight_bytes / 1e6:.2f}"),
    )


def _threads(found: MeasuredCurves) -> str:
    return "1 thread" if found.cores == 1 else f"{found.cores} threads"


def _said(load: float | None) -> str:
    return "unknown" if load is None else f"{load:.1f}"
