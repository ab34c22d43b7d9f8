"""How ``touchstone tables`` prints its rows: errors, other means, and each object's own."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from rich.table import Table

from harness.commands.output import ANSWERS

if TYPE_CHECKING:  # the command's help needs no arrays
    from harness.basics.metrics import Interval
    from harness.experiment.experiment import MeasuredColumn
    from harness.experiment.tables import Key, TableRow

_HEADINGS = ("method", "median", "mean", "gross", "refused", "answered", "modulo symmetry", "region", "s")
_GAPS = {"default": "on", "none": "off"}
"""Of gaps, in a title."""

_SCALES = {"mm": 1e3, "%": 100.0}


def plain_row(row: "TableRow") -> dict[str, Any]:
    """A row as JSON values, its conditions and further means by their names."""
    tree = asdict(row)
    return {**tree.pop("conditions"), **tree.pop("means"), **tree}


def print_table(table: Sequence["TableRow"], columns: Sequence["MeasuredColumn"] = ()) -> None:
    """A table a condition: errors; then the experiment's other means, where it has any."""
    for condition in sorted({tuple(row.conditions.items()) for row in table}):
        chosen = [row for row in table if tuple(row.conditions.items()) == condition]
        title = f"mock: {_said(condition)}; {chosen[0].runs} runs"
        _print(f"{title}; mm [5 to 95 %]", _HEADINGS, [_cells(row) for row in chosen])
        if columns:
            headings = ["method", *(f"{column.heading}, {column.unit}" for column in columns)]
            _print(f"{title}; means", headings, [_means(row, columns) for row in chosen])


def print_by_object(
    condition: "Key", value: str, means: Mapping[str, Mapping[str, float]], methods: Iterable[str]
) -> None:
    """The mean of each method on each object, under one condition, in mm.

    Args:
        condition: of the runs.
        value: what it is the mean of.
        means: m, by object and method; a method that an object has not is left open there.
        methods: in the order of the table.
    """
    title = f"mock: {_said(condition)}; mean {value} of each object, in mm"
    drawn = Table(title=title, box=None, padding=(0, 1, 0, 0))
    drawn.add_column("method", no_wrap=True)
    for name in means:
        drawn.add_column(name, no_wrap=True, justify="right")
    for method in dict.fromkeys(methods):
        found = [one.get(method) for one in means.values()]
        if any(one is not None for one in found):
            drawn.add_row(method, *("" if one is None else f"{1e3 * one:.1f}" for one in found))
    ANSWERS.print(drawn)


def print_published(published: Mapping[str, Sequence[float]]) -> None:
    """What others printed, for the foot; nothing where nobody did."""
    if published:
        said = "; ".join(
            f"{name}: {', '.join(f'{v:g}' for v in values)}" for name, values in published.items()
        )
        ANSWERS.print(f"the paper (ObjectFolder 2.0, other objects, mean error in cm): {said}", markup=False)


def _said(condition: "Key") -> str:
    return ", ".join(f"{name} {_GAPS.get(level, level)}" for name, level in condition)


def _print(title: str, headings: Sequence[str], lines: Sequence[Sequence[str]]) -> None:
    """The columns that have anything in them."""
    drawn = Table(title=title)
    shown = [k for k in range(len(headings)) if any(line[k] for line in lines)]
    for k in shown:
        drawn.add_column(headings[k], no_wrap=True)
    for line in lines:
        drawn.add_row(*(line[k] for k in shown))
    ANSWERS.print(drawn)


def _cells(row: "TableRow") -> list[str]:
    median, mean, gross = row.raw
    symmetric = "" if row.symmetric is None else (
        f"{1e3 * row.symmetric[0].value:.1f} / {1e3 * row.symmetric[1].value:.1f} / "
        f"{100 * row.symmetric[2].value:.0f} %"
    )  # fmt: skip
    return [
        row.method,
        _interval(median, 1e3, 1),
        _interval(mean, 1e3, 1),
        _interval(gross, 100, 0) + " %",
        str(row.refused or ""),
        "" if row.answered is None else _interval(row.answered, 1e3, 1),
        symmetric,
        "" if row.held is None else f"{100 * row.held:.0f} %",
        f"{row.seconds:.2f}",
    ]


def _means(row: "TableRow", columns: Sequence["MeasuredColumn"]) -> list[str]:
    shown = [
        f"{_SCALES[column.unit] * row.means[column.key]:.1f}" if column.key in row.means else ""
        for column in columns
    ]
    return [row.method, *shown]


def _interval(interval: "Interval", scale: float, digits: int) -> str:
    value, low, high = (scale * number for number in (interval.value, interval.low, interval.high))
    return f"{value:.{digits}f} \\[{low:.{digits}f} {high:.{digits}f}]"
