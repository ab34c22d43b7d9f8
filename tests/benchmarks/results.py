"""Figures of benchmarks: printed as a table, or written into docs/results/data.

A script writes them with ``--write``, a benchmark of pytest with the environment's ``WRITE_RESULTS=1``. Then
``make results`` renders the pages.
"""

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


def benchmark_parser(description: str | None) -> ArgumentParser:
    """Make the parser of a script whose figures can be written."""
    parser = ArgumentParser(description=description)
    parser.add_argument(WRITE, action="store_true", help="replace the figures in docs/results/data")
    return parser


def spread(values: ArrayLike, low: float = 0.0, high: float = 1.0) -> Spread:
    """Summarize repeated values by their median and two quantiles, least and greatest by default."""
    least, middle, most = np.quantile(np.asarray(values, dtype=np.float64), (low, 0.5, high))
    return Spread(value=float(middle), low=float(least), high=float(most))


def finish_figure(page: str, figure: str, columns: str, rows: Iterable[Sequence[Cell]]) -> None:
    """Print a figure, or replace the figure of the same name on its page.

    Args:
        page: name of the page's JSON, without suffix.
        figure: its ``id`` there; title, conclusion and source are kept. Printed if the page has none.
        columns: heads separated by ``;``, each a name, its unit in brackets if it has one and the format of
            its floats if it is not ``.3g``: ``case; time [s] .2f``.
        rows: one entry for each column. Floats are rounded to the column's format.
    """
    heads = tuple(_column(text) for text in columns.split(";"))
    formats = [head.format or ".3g" for head in heads]
    kept = tuple(tuple(_round(*each) for each in zip(row, formats, strict=True)) for row in rows)
    old = read_page(page)
    wanted = WRITE in sys.argv or "WRITE_RESULTS" in os.environ
    if not wanted or figure not in [each.id for each in old.figures]:
        table = Table(*(f"{head.name}, {head.unit}".removesuffix(", ") for head in heads), title=figure)
        for row in kept:
            table.add_row(*(show_cell(*each) for each in zip(row, formats, strict=True)))
        Console(highlight=False, width=150).print(table)
        return
    update = {
        "columns": heads,
        "rows": kept,
        "command": _command(),
        "commit": _git("describe", "--always", "--dirty", "--exclude=*"),
        "date": datetime.now(UTC).date().isoformat(),
        "machine": _machine(),
    }
    figures = tuple(each.model_copy(update=update) if each.id == figure else each for each in old.figures)
    write_page(page, old.model_copy(update={"figures": figures}))


def _column(text: str) -> Column:
    found = re.fullmatch(r"\s*(.*?)(?: \[(.*)\])?(?: (#?\+?\.\d[efg%]))?\s*", text)
    assert found is not None
    return Column(name=found[1], unit=found[2] or "", format=found[3] or "")


def _round(cell: Cell, spec: str) -> Cell:
    if isinstance(cell, Spread):
        value, low, high = (float(f"{each:{spec}}") for each in (cell.value, cell.low, cell.high))
        return Spread(value=value, low=low, high=high)
    return float(f"{cell:{spec}}") if isinstance(cell, float) else cell


def _command() -> str:
    words = [word for word in sys.orig_argv[1:] if word != WRITE]
    if Path(words[0]).is_absolute():
        words[0] = os.path.relpath(words[0], ROOT)
    return "python " + shlex.join(words)


def _git(*words: str) -> str:
    line = ["git", *words]
    return subprocess.run(line, cwd=ROOT, check=True, capture_output=True, text=True).stdout.strip()


def _machine() -> str:
    processors = Path("/proc/cpuinfo")
    told = re.search(r"model name\s*: (.*)", processors.read_text()) if processors.exists() else None
    model = told[1] if told else platform.machine()
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    return f"{model}, {os.cpu_count()} cores, {memory:.0f} GB, Python {platform.python_version()}"
