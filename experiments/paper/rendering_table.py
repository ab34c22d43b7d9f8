"""Tables 1 and 2 of ObjectFolder 2.0: rows quoted of the paper, rows measured here, and how both are printed.

Gao et al., CVPR 2022. Quoted seconds are of "one observation sample for each modality"; the program published
with the paper runs on a GPU, of which neither says the make. Quality of touch is against pictures of real
sensors, a DIGIT for 1.0 and a GelSight for 2.0, so that its two rows are of two experiments, and neither is
ours.
"""

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from rich.table import Table

from experiments.paper.look import look_methods, view_bench
from experiments.paper.rendering import (
    COLUMNS,
    SENSES,
    MeasuredMethod,
    RenderingBench,
    RenderingMethod,
    RenderingWork,
    Sense,
    measure_sense,
)
from experiments.paper.sound import sound_methods, strike_bench
from experiments.paper.touch import first_touch, touch_bench, touch_methods, untouched
from harness.basics.metrics import Interval, bootstrap, mean
from harness.commands.output import ANSWERS
from harness.cost.provenance import machine
from harness.objectfile.file import ObjectFile
from harness.objectfile.touch.nodes import NodeSearch
from harness.objectfile.touch.touch import nodes_of

QUOTED_SECONDS: Final[Mapping[str, Mapping[str, float]]] = MappingProxyType({
    "ObjectFolder 1.0": {"vision": 3.699, "audio": 0.420, "touch": 0.010},
    "ObjectFolder 2.0": {"vision": 0.062, "audio": 0.035, "touch": 0.014},
})  # fmt: skip
"""Table 1, in s: by row and sense."""

QUOTED_QUALITY: Final[Mapping[str, Mapping[str, Mapping[str, float]]]] = MappingProxyType({
    "ObjectFolder 1.0": {
        "vision": {"psnr_db": 35.7, "ssim": 0.97},
        "audio": {"stft_distance": 4.94e-5, "envelope_distance": 7.65e-4},
        "touch": {"psnr_db": 27.9, "ssim": 0.64},
    },
    "ObjectFolder 2.0": {
        "vision": {"psnr_db": 36.3, "ssim": 0.98},
        "audio": {"stft_distance": 0.19e-5, "envelope_distance": 1.29e-4},
        "touch": {"psnr_db": 31.6, "ssim": 0.78},
    },
})  # fmt: skip
"""Table 2: by row, sense and metric."""

QUOTED_MACHINE: Final = "a GPU that the paper does not name"

METRICS: Mapping[Sense, tuple[str, str]] = {
    "vision": ("psnr_db", "ssim"),
    "audio": ("stft_distance", "envelope_distance"),
    "touch": ("psnr_db", "ssim"),
}
"""Of table 2, by sense."""

QUOTED = "quoted"
_FIRST = ("object", "sense", "method", "column", "seconds", "seconds_low", "seconds_high", "timings")
"""Columns of the CSV before the metrics."""

UPRIGHT = ", upright presses alone"


@dataclass(frozen=True)
class RenderingCounts:
    """How many queries each sense is measured on."""

    views: int = 4  #: pictures.
    strikes: int = 30  #: held-out places that are struck.
    presses: int = 60  #: that are drawn; impossible ones are left out.


@dataclass(frozen=True)
class RenderingRow:
    """One row of one sense."""

    object: str  #: name; ``"quoted"`` of what the paper prints.
    sense: Sense  #: of the row.
    method: str  #: its name.
    column: str  #: the row of tables 1 and 2 that it fills.
    seconds: tuple[float, float, float] | None
    """s of one observation: median, lower and upper quartile; None where there is none. Of quoted rows the
    paper's number thrice."""
    timings: int  #: observations that were timed; 0 of quoted rows.
    metrics: Mapping[str, Interval]  #: means over queries with their 90 % intervals, by the paper's name.
    queries: int  #: that these are means over.
    made: float  #: CPU s of fitting or training here.
    note: str  #: what a reader has to know.


def quoted_rows() -> list[RenderingRow]:
    """What the paper prints, of both versions."""
    return [
        RenderingRow(
            QUOTED, sense, version, f"{version}, quoted", (QUOTED_SECONDS[version][sense],) * 3, 0,
            {name: Interval(*(value,) * 3) for name, value in QUOTED_QUALITY[version][sense].items()},
            0, 0.0, QUOTED_MACHINE,
        )
        for sense in SENSES for version in QUOTED_SECONDS
    ]  # fmt: skip


def measured_rows(
    of: ObjectFile, senses: Sequence[Sense], counts: RenderingCounts, work: RenderingWork
) -> Iterator[RenderingRow]:
    """Every method of each sense of an object, from the store where it was measured before.

    Raises:
        DataRefused: an object whose reference cannot be computed.
        MeshRefused: likewise.
    """
    for sense in senses:
        for bench, methods in _measured(of, sense, counts, work):
            for found in measure_sense(bench, methods, work):
                yield row_of(of.description.name, bench.count, sense, found)


def _measured(
    of: ObjectFile, sense: Sense, counts: RenderingCounts, work: RenderingWork
) -> Iterator[tuple[RenderingBench, list[RenderingMethod]]]:
    mesh = of.mesh
    match sense:
        case "vision":
            views = view_bench(of, counts.views, work)
            yield views, look_methods(views, of, work)
        case "audio":
            strikes = strike_bench(mesh, of.description.material.material(), counts.strikes, work)
            yield strikes, sound_methods(strikes, work)
        case "touch":
            codes: NodeSearch | None = None
            entry = of.description.touch
            if entry is not None and entry.codes is not None:
                codes = NodeSearch(nodes_of(of, entry.codes), entry.codes.most_off_m)
            presses = touch_bench(mesh, counts.presses, "any", work, codes)
            yield presses, touch_methods(presses, of, work)
            upright = touch_bench(mesh, counts.presses, "upright", work, codes)
            yield upright, [untouched(upright, UPRIGHT), first_touch(upright, work, UPRIGHT)]


def row_of(name: str, queries: int, sense: Sense, found: MeasuredMethod) -> RenderingRow:
    """Create the row of a measured method; without numbers if it could not be measured."""
    method = found.method
    seconds = None
    if len(found.seconds):
        low, middle, high = np.quantile(found.seconds, [0.25, 0.5, 0.75])
        seconds = float(middle), float(low), float(high)
    metrics = {key: bootstrap(values, mean) for key, values in found.scores.items()}
    note = "; ".join(part for part in (method.note, found.missing) if part)
    return RenderingRow(
        *(name, sense, method.name, method.column, seconds, len(found.seconds)),
        *(metrics, queries, found.made, note),
    )


def machine_text() -> str:
    """Name the processor that seconds were measured on, and its number of cores."""
    known = machine()
    return f"{known['cpu']}, {known['cores']} virtual cores, one thread"


def as_csv(rows: Sequence[RenderingRow]) -> str:
    """One line a row, SI units, empty where there is no number."""
    names = list(dict.fromkeys(name for metrics in METRICS.values() for name in metrics))
    parts = [f"{name}{end}" for name in names for end in ("", "_low", "_high")]
    text = io.StringIO()
    writer = csv.DictWriter(text, [*_FIRST, *parts, "queries", "made_s", "note"], lineterminator="\n")
    writer.writeheader()
    writer.writerows(plain_rendering(row) for row in rows)
    return text.getvalue()


def plain_rendering(row: RenderingRow) -> dict[str, Any]:
    """A row as JSON values; numbers that there are not are left out."""
    plain: dict[str, Any] = {"object": row.object, "sense": row.sense, "method": row.method}
    plain |= {"column": row.column, "timings": row.timings, "queries": row.queries}
    plain |= {"made_s": row.made, "note": row.note}
    if row.seconds is not None:
        plain |= dict(zip(("seconds", "seconds_low", "seconds_high"), row.seconds, strict=True))
    for name, interval in row.metrics.items():
        plain |= {name: interval.value, f"{name}_low": interval.low, f"{name}_high": interval.high}
    return plain


_METRICS: Mapping[str, tuple[str, float, str]] = {
    "psnr_db": ("PSNR, dB", 1.0, ".1f"),
    "ssim": ("SSIM", 1.0, ".3f"),
    "stft_distance": ("STFT, 1e-5", 1e5, ".3g"),
    "envelope_distance": ("envelope, 1e-4", 1e4, ".3g"),
}
"""Heading, factor and format of each."""

_MILLI = 1e3


def print_tables(rows: Sequence[RenderingRow], machine: str) -> None:
    """Print tables 1 and 2 of each object, then all rows of each sense; ``machine`` measured the seconds."""
    quoted = [row for row in rows if row.object == QUOTED]
    for name in dict.fromkeys(row.object for row in rows if row.object != QUOTED):
        own = [row for row in rows if row.object == name]
        _first(name, [*quoted, *own])
        _second(name, [*quoted, *own])
        for sense in dict.fromkeys(row.sense for row in own):
            _every(name, sense, [row for row in own if row.sense == sense])
    ANSWERS.print(f"Measured rows: CPU seconds on {machine}. Quoted rows: ObjectFolder 2.0, its own objects, "
                  f"{quoted[0].note}.", markup=False)  # fmt: skip


def _columns(rows: Sequence[RenderingRow]) -> list[str]:
    names = [row.column for row in rows]
    return [name for name in dict.fromkeys([*names, *COLUMNS]) if name != "other" and name in names]


def _first(name: str, rows: Sequence[RenderingRow]) -> None:
    drawn = Table(title=f"Table 1, {name}: ms of one observation")
    for heading in ("", *SENSES, "total"):
        drawn.add_column(heading, no_wrap=True)
    for column in _columns(rows):
        found = {row.sense: row.seconds for row in rows if row.column == column and row.seconds is not None}
        total = sum(found[sense][0] for sense in SENSES) if len(found) == len(SENSES) else None
        cells = [_time(found.get(sense)) for sense in SENSES]
        drawn.add_row(column, *cells, "" if total is None else f"{total * _MILLI:.3g}")
    ANSWERS.print(drawn)


def _second(name: str, rows: Sequence[RenderingRow]) -> None:
    drawn = Table(title=f"Table 2, {name}: quality")
    drawn.add_column("", no_wrap=True)
    keys = [(sense, metric) for sense in SENSES for metric in METRICS[sense]]
    for sense, metric in keys:
        drawn.add_column(f"{sense} {_METRICS[metric][0]}")
    for column in _columns(rows):
        found = {row.sense: row.metrics for row in rows if row.column == column}
        cells = []
        for sense, metric in keys:
            interval = found.get(sense, {}).get(metric)
            _, factor, shape = _METRICS[metric]
            cells.append("" if interval is None else format(interval.value * factor, shape))
        drawn.add_row(column, *cells)
    ANSWERS.print(drawn)


def _every(name: str, sense: Sense, rows: Sequence[RenderingRow]) -> None:
    drawn = Table(title=f"{name}, {sense}: means [90 % interval], median ms (quartiles)")
    headings = [_METRICS[metric][0] for metric in METRICS[sense]]
    for heading in ("method", "ms", *headings, "queries", "made in, s", "note"):
        drawn.add_column(heading)
    for row in rows:
        values = [_interval(row.metrics.get(metric), metric) for metric in METRICS[sense]]
        made = f"{row.made:.0f}" if row.made else ""
        drawn.add_row(row.method, _time(row.seconds), *values, str(row.queries), made, row.note)
    ANSWERS.print(drawn)


def _time(seconds: tuple[float, float, float] | None) -> str:
    if seconds is None:
        return ""
    middle, low, high = (each * _MILLI for each in seconds)
    return f"{middle:.3g}" if np.isclose(low, high) else f"{middle:.3g} ({low:.3g} to {high:.3g})"


def _interval(interval: Interval | None, metric: str) -> str:
    if interval is None:
        return ""
    _, factor, shape = _METRICS[metric]
    value, low, high = (
        format(each * factor, shape) for each in (interval.value, interval.low, interval.high)
    )
    return f"{value} \\[{low} {high}]"
