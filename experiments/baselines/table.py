"""The rows of the tables: quoted ones, and measured ones with their spread."""

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from experiments.baselines import quoted
from experiments.baselines.bench import SENSES, RenderingBench, RenderingMethod, RenderingWork, Sense
from experiments.baselines.look.bench import view_bench
from experiments.baselines.look.methods import look_methods
from experiments.baselines.measure import MeasuredMethod, measure_sense
from experiments.baselines.sound.bench import strike_bench
from experiments.baselines.sound.methods import sound_methods
from experiments.baselines.touch.bench import touch_bench
from experiments.baselines.touch.methods import first_touch, touch_methods, untouched
from harness.basics.metrics import Interval, bootstrap, mean
from harness.cost.provenance import machine
from harness.objectfile.file import ObjectFile
from harness.objectfile.touch.nodes import NodeSearch
from harness.objectfile.touch.touch import CodeMaps, open_touch

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
    """How many queries each sense is measured on.

    Attributes:
        views: pictures.
        strikes: held-out places that are struck.
        presses: that are drawn; impossible ones are left out.
    """

    views: int = 4
    strikes: int = 30
    presses: int = 60


@dataclass(frozen=True)
class RenderingRow:
    """One row of one sense.

    Attributes:
        object: name; ``"quoted"`` of what the paper prints.
        sense: of the row.
        method: its name.
        column: the row of tables 1 and 2 that it fills.
        seconds: s of one observation: median, lower and upper quartile; None where there is none. Of quoted
            rows the paper's number thrice.
        timings: observations that were timed; 0 of quoted rows.
        metrics: means over queries with their 90 % intervals, by the paper's name.
        queries: that these are means over.
        made: CPU s of fitting or training here.
        note: what a reader has to know.
    """

    object: str
    sense: Sense
    method: str
    column: str
    seconds: tuple[float, float, float] | None
    timings: int
    metrics: Mapping[str, Interval]
    queries: int
    made: float
    note: str


def quoted_rows() -> list[RenderingRow]:
    """What the paper prints, of both versions."""
    return [
        RenderingRow(
            QUOTED, sense, version, f"{version}, quoted", (quoted.SECONDS[version][sense],) * 3, 0,
            {name: Interval(*(value,) * 3) for name, value in quoted.QUALITY[version][sense].items()},
            0, 0.0, quoted.MACHINE,
        )
        for sense in SENSES for version in quoted.SECONDS
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
            codes = _codes_of(of)
            presses = touch_bench(mesh, counts.presses, "any", work, codes)
            yield presses, touch_methods(presses, of, work)
            upright = touch_bench(mesh, counts.presses, "upright", work, codes)
            yield upright, [untouched(upright, UPRIGHT), first_touch(upright, work, UPRIGHT)]


def _codes_of(of: ObjectFile) -> NodeSearch | None:
    entry = of.description.touch
    if entry is None or entry.codes is None:
        return None
    maps = open_touch(of, "codes").maps
    assert isinstance(maps, CodeMaps)
    return maps.nodes


def row_of(name: str, queries: int, sense: Sense, found: MeasuredMethod) -> RenderingRow:
    """The row of a measured method; without numbers where it could not be made."""
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
    """The processor that seconds were taken on, and how many cores of it there are."""
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
