"""Read the cells of a catalogue in CSV, whichever column separator the spreadsheet wrote."""

import csv
from collections.abc import Iterator, Sequence
from pathlib import Path

from harness.basics.errors import WrongUse
from harness.basics.files.foreign_file import MOST_JSON
from harness.basics.files.named_file import nearest
from harness.basics.files.text_file import read_text

PUBLISHED = ("number", "name", "scale_m", "material", "source")
"""Columns of ObjectFolder's ``objects.csv``, which has no header."""

COLUMNS = (*PUBLISHED, "mesh", "units", "wall_m", "mass_kg", "licence", "up_axis")
"""Columns that the header of a CSV file may name."""

_SEPARATORS = {",": "commas", ";": "semicolons", "\t": "tabs", "|": "vertical bars"}
_MAX_LINE = 2**16
"""Characters of one line; the longest published row has 200."""

_MAX_ROWS = 100_000


def read_csv_rows(path: Path) -> tuple[list[tuple[str, dict[str, str]]], tuple[str, ...]]:
    """Read the rows of a CSV file by column, and notes on the file.

    Args:
        path: path of a file with a header of ``COLUMNS``, or without a header and with the columns
            ``PUBLISHED``.

    Returns:
        For each row its line, e.g. "line 3", and its cells by column; notes on the file, a sentence each.

    Raises:
        WrongUse: the file cannot be read, has an unknown column, or is larger than a catalogue.
    """
    # A text of 64 MiB is split line by line: a list of all its cells takes gigabytes.
    lines = read_text(path, "a catalogue", MOST_JSON, WrongUse).rstrip("\n").split("\n", _MAX_ROWS)
    if len(lines) > _MAX_ROWS:
        raise WrongUse(f"{path} has more than {_MAX_ROWS:,} lines; split the catalogue")
    separator, skipped = _separator(lines)
    records = list(_records(lines[skipped:], skipped, separator, path))
    columns = _header(records[0][1], path) if records else None
    rows = records if columns is None else records[1:]
    used = tuple(columns or PUBLISHED)
    notes = () if separator == "," else (f"the columns are separated by {_SEPARATORS[separator]}",)
    return [(where, _cells(used, cells, separator)) for where, cells in rows], notes


def _separator(lines: Sequence[str]) -> tuple[str, int]:
    """Find the column separator, and how many lines at the top of the file only name it."""
    named = lines[0].strip(' "').lower()
    if named.startswith("sep=") and named[4:] in _SEPARATORS:
        return named[4:], 1
    # A tab is white space: it is not stripped with the line.
    first = next((line for line in lines if line.strip()), "")[:_MAX_LINE]
    cells = {
        separator: [cell.strip(' "').lower() for cell in first.split(separator)] for separator in _SEPARATORS
    }
    headed = [separator for separator in _SEPARATORS if "name" in cells[separator]]
    if headed:
        return max(headed, key=lambda separator: len(cells[separator])), 0
    if len(cells[","]) >= len(PUBLISHED) - 1:
        return ",", 0
    return max(_SEPARATORS, key=lambda separator: len(cells[separator])), 0


def _records(
    lines: Sequence[str], skipped: int, separator: str, path: Path
) -> Iterator[tuple[str, list[str]]]:
    """Split lines into the cells of each row that has any; a quoted cell may hold a line end."""
    reader = csv.reader(_bounded(lines, skipped, path), delimiter=separator)
    begins = 1
    try:
        for cells in reader:
            if any(map(str.strip, cells)):
                yield f"line {skipped + begins}", cells
            begins = reader.line_num + 1
    except csv.Error as error:
        raise WrongUse(
            f"{path}, line {skipped + begins} does not read as CSV: {error}; export it again"
        ) from error


def _bounded(lines: Sequence[str], skipped: int, path: Path) -> Iterator[str]:
    for number, line in enumerate(lines):
        if len(line) > _MAX_LINE:
            raise WrongUse(
                f"{path}, line {skipped + number + 1} has {len(line):,} characters; a row of a catalogue "
                f"has at most {_MAX_LINE:,}"
            )
        yield line + "\n"


def _header(cells: Sequence[str], path: Path) -> tuple[str, ...] | None:
    """Read the column names of a header; None for the first row of a file without one."""
    names = tuple(cell.strip().lower() for cell in cells)
    if "name" not in names:
        return None
    while names and not names[-1]:  # spreadsheets write a separator after the last column
        names = names[:-1]
    for name in names:
        if name not in COLUMNS:
            raise WrongUse(f"{path}: unknown column {name!r}; {nearest(name, COLUMNS)}")
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise WrongUse(f"{path}: two columns are named {twice!r}; leave one out")
    return names


def _cells(columns: Sequence[str], cells: Sequence[str], separator: str) -> dict[str, str]:
    """Name cells by their columns; join further cells under ``"more"``; leave missing ones out."""
    found = {name: cell.strip() for name, cell in zip(columns, cells, strict=False)}
    more = separator.join(cells[len(columns) :])
    return found | ({"more": more} if more.strip(f" {separator}") else {})
