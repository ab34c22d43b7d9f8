"""How the tables are printed: tables 1 and 2 as in the paper, then every row of each sense."""

from collections.abc import Mapping, Sequence

import numpy as np
from rich.table import Table

from experiments.baselines.bench import COLUMNS, SENSES, Sense
from experiments.baselines.table import METRICS, QUOTED, RenderingRow
from harness.basics.metrics import Interval
from harness.commands.output import ANSWERS

_METRICS: Mapping[str, tuple[str, float, str]] = {
    "psnr_db": ("PSNR, dB", 1.0, ".1f"),
    "ssim": ("SSIM", 1.0, ".3f"),
    "stft_distance": ("STFT, 1e-5", 1e5, ".3g"),
    "envelope_distance": ("envelope, 1e-4", 1e4, ".3g"),
}
"""Heading, factor and format of each."""

_MILLI = 1e3


def print_tables(rows: Sequence[RenderingRow], machine: str) -> None:
    """Tables 1 and 2 of each object, then all rows of each sense.

    Args:
        rows: quoted and measured ones.
        machine: that the measured seconds are of.
    """
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
        drawn.add_row(column, *(_value(found.get(sense, {}).get(metric), metric) for sense, metric in keys))
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


def _value(interval: Interval | None, metric: str) -> str:
    _, factor, shape = _METRICS[metric]
    return "" if interval is None else format(interval.value * factor, shape)


def _interval(interval: Interval | None, metric: str) -> str:
    if interval is None:
        return ""
    _, factor, shape = _METRICS[metric]
    value, low, high = (
        format(each * factor, shape) for each in (interval.value, interval.low, interval.high)
    )
    return f"{value} \\[{low} {high}]"
