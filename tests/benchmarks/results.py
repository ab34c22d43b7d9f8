"""Figures of benchmarks: printed as a table, or written into docs/results/data.

A script writes them with ``--write``, a benchmark of pytest with the environment's ``WRITE_RESULTS=1``. The
rows of ``touchstone tables EXPERIMENT --json > FILE`` are written by ``python -m tests.benchmarks.results
PAGE FIGURE FILE --command "touchstone tables EXPERIMENT" --write``. Then ``make results`` renders the pages.
"""

import json
import os
import platform
import re
import shlex
import subprocess
import sys
from argparse import ArgumentParser
from collections.abc import Iterable, Sequence
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from rich.console import Console
from rich.table import Table

from tests.docs.results import Cell, Column, Spread, read_page, show_cell, write_page

ROOT = Path(__file__).parents[2]
WRITE = "--write"
NUMBER = r"([+-]?\d+(?:\.\d+)?(?:e[+-]?\d+)?)"


def benchmark_parser(description: str | None) -> ArgumentParser:
    """Make the parser of a script whose figures can be written."""
    parser = ArgumentParser(description=description)
    parser.add_argument(WRITE, action="store_true", help="replace the figures in docs/results/data")
    return parser


def spread(values: ArrayLike, low: float = 0.0, high: float = 1.0) -> Spread:
    """Summarize repeated values by their median and two quantiles, least and greatest by default."""
    least, middle, most = np.quantile(np.asarray(values, dtype=np.float64), (low, 0.5, high))
    return Spread(value=float(middle), low=float(least), high=float(most))


def finish_figure(
    page: str, figure: str, columns: str, rows: Iterable[Sequence[Cell]], command: str = ""
) -> None:
    """Print a figure, or replace the figure of the same name on its page.

    Args:
        page: name of the page's JSON, without suffix.
        figure: its ``id`` there; title, conclusion and source are kept. Printed if the page has none.
        columns: heads separated by ``;``, each a name, its unit in brackets if it has one and the format of
            its floats if it is not ``.3g``: ``case; time [s] .2f``.
        rows: one entry for each column. Floats are rounded to the column's format; text that is a number, or
            one with its extremes as ``1.6 (1.5 to 1.7)``, is kept as numbers.
        command: line that measured the rows; this program's own by default.
    """
    heads = tuple(_parse_column(text) for text in columns.split(";"))
    formats = [head.format or ".3g" for head in heads]
    kept = tuple(tuple(_round(*each) for each in zip(row, formats, strict=True)) for row in rows)
    old = read_page(page)
    wanted = WRITE in sys.argv or "WRITE_RESULTS" in os.environ
    if not wanted or figure not in [each.id for each in old.figures]:
        table = Table(*(f"{head.name}, {head.unit}".removesuffix(", ") for head in heads), title=figure)
        for row in kept:
            table.add_row(*(show_cell(cell, head.format) for cell, head in zip(row, heads, strict=True)))
        Console(highlight=False, width=150).print(table)
        return
    update = {
        "columns": heads,
        "rows": kept,
        "command": command or _read_command(),
        "commit": _describe_commit(),
        "date": datetime.now(UTC).date().isoformat(),
        "machine": _describe_machine(),
    }
    figures = tuple(each.model_copy(update=update) if each.id == figure else each for each in old.figures)
    write_page(page, old.model_copy(update={"figures": figures}))


def _parse_column(text: str) -> Column:
    found = re.fullmatch(r"\s*(.*?)(?: \[(.*)\])?(?: (#?\+?\.\d[efg]))?\s*", text)
    assert found is not None
    return Column(name=found[1], unit=found[2] or "", format=found[3] or "")


def _round(cell: Cell, spec: str) -> Cell:
    if isinstance(cell, str) and (found := re.fullmatch(rf"{NUMBER}(?: \({NUMBER} to {NUMBER}\))?", cell)):
        values = [int(text) if text.isdigit() else float(text) for text in found.groups() if text]
        return Spread(value=values[0], low=values[1], high=values[2]) if len(values) > 1 else values[0]
    if isinstance(cell, Spread):
        value, low, high = (float(f"{each:{spec}}") for each in (cell.value, cell.low, cell.high))
        return Spread(value=value, low=low, high=high)
    if isinstance(cell, float):
        return float(f"{cell:{spec}}") if np.isfinite(cell) else None
    return cell


def _read_command() -> str:
    words = [word for word in sys.orig_argv[1:] if word != WRITE]
    if Path(words[0]).is_absolute():
        words[0] = os.path.relpath(words[0], ROOT)
    return ("PYTHONPATH=. " if "PYTHONPATH" in os.environ else "") + "python " + shlex.join(words)


def _describe_commit() -> str:
    """Name the commit; changes of the results themselves do not make it dirty."""
    commit, changes = (
        subprocess.run(["git", *words], cwd=ROOT, check=True, capture_output=True, text=True).stdout.strip()  # noqa: S607
        for words in (
            ("rev-parse", "--short=8", "HEAD"),
            ("status", "--porcelain", "--untracked-files=no", "--", ".", ":!docs/results"),
        )
    )
    return commit + ("-dirty" if changes else "")


def _describe_machine() -> str:
    processors = Path("/proc/cpuinfo")
    told = re.search(r"model name\s*: (.*)", processors.read_text()) if processors.exists() else None
    model = told[1] if told else platform.machine()
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    return f"{model}, {os.cpu_count()} cores, {memory:.0f} GB, Python {platform.python_version()}"


def main() -> None:
    """Print or write the rows that ``touchstone tables`` of an experiment printed as JSON."""
    parser = benchmark_parser(__doc__)
    parser.add_argument("page")
    parser.add_argument("figure")
    parser.add_argument("file", type=Path)
    parser.add_argument("--command", required=True)
    given = parser.parse_args()
    rows = []
    for row in json.loads(given.file.read_text(encoding="utf-8"))["rows"]:
        median, mean, gross = (each["value"] for each in row["raw"])
        conditions = [value for key in ("spacing", "yaw", "gap", "shape", "look") if (value := row.get(key))]
        held = None if row["held"] is None else 100.0 * row["held"]
        name = ", ".join([row["method"], *conditions])
        rows.append([name, row["runs"], row["refused"], 1e3 * median, 1e3 * mean, 100.0 * gross, held])
    heads = "method and condition; runs; refused; median error [mm] .1f; mean error [mm] .1f"
    gross_and_held = "above the limit [%] .1f; region holds [%] .1f"
    finish_figure(given.page, given.figure, f"{heads}; {gross_and_held}", rows, given.command)


if __name__ == "__main__":
    main()
