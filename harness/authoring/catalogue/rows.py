"""A catalogue of objects: rows of a CSV or TOML file, and the rows that cannot be built, with reasons."""

import csv
import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

from pydantic import Field

from harness.basics.errors import WrongUse
from harness.basics.files.foreign_file import MOST_JSON
from harness.basics.files.named_file import nearest, require_file
from harness.basics.files.text_file import read_text
from harness.basics.materials import MATERIALS
from harness.basics.quantities import MASS, Length, Positive
from harness.basics.toml_file import StrictModel, load_toml
from harness.objects.builtin import BUILTIN

_NOTHING = ("", "none", "null", "nan", "n/a")
_COMMA = re.compile(r"(?P<whole>\+?\d*),(?P<decimals>\d+)(?:[eE][+-]?\d+)?")
"""A number with a decimal comma; with three decimals the comma may also separate thousands."""

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,79}")

PUBLISHED = ("number", "name", "scale_m", "material", "source")
"""Columns of ObjectFolder's ``objects.csv``, which has no header."""

COLUMNS = (*PUBLISHED, "mesh", "units", "wall_m", "mass_kg", "licence", "up_axis")
"""Columns that the header of a CSV file may name."""

_SEPARATORS = {",": "commas", ";": "semicolons", "\t": "tabs", "|": "vertical bars"}
_MAX_LINE = 2**16
"""Characters of one line; the longest published row has 200."""

_MAX_ROWS = 100_000

_COLUMNS = {"scale": "scale_m", "wall": "wall_m", "mass": "mass_kg"}

SUFFIXES = (".obj", ".ply", ".stl", ".off", ".glb", ".gltf", ".3mf", ".msh")
"""Of files that are searched for, in order of preference; a row may name any other that reads."""

_OF_A_FOLDER = ("model", "textured", "nontextured")
"""Names of the mesh in a folder of one object, as ObjectFolder and YCB publish it."""


@dataclass(frozen=True)
class CatalogueRow:
    """One object as its catalogue describes it."""

    name: str  #: of the object, and of its folder; unique in the catalogue.
    material: str  #: one of the seven, in lower case.
    number: str = ""  #: in the catalogue, as published; "" where it has none.
    scale: float | None = None  #: m, the label of the object's longest side; None where it has none.
    mesh: str | None = None
    """a file, relative to the folder of meshes, or ``builtin:`` and a name; None to search for one."""
    units: str | None = None  #: of the file's numbers; None where the file or the label decides.
    wall: float | None = None  #: m, of a hollow thing of which the file has the outside.
    mass: float | None = None  #: kg, of the real object; None where nobody weighed it.
    licence: str = "unknown"  #: of the mesh.
    source: str | None = None  #: where the mesh comes from; None where the catalogue does not say.
    up_axis: str | None = None  #: axis of the file that points up; None for the one that it declares, else z.


@dataclass(frozen=True)
class ExcludedRow:
    """A row that is not built."""

    name: str  #: of the object, or of the line where it has none.
    reason: str  #: a sentence with the value, the limit, and what to do.


@dataclass(frozen=True)
class Catalogue:
    """What a catalogue's file lists."""

    path: Path  #: of the file.
    rows: tuple[CatalogueRow, ...]  #: in their order.
    excluded: tuple[ExcludedRow, ...]  #: rows that cannot be built.
    notes: tuple[str, ...]  #: on the file as a whole, a sentence each.


class RowRefused(Exception):
    """A row that cannot be built; its text is the reason."""


def read_catalogue(path: Path) -> Catalogue:
    """Read a catalogue; a row that cannot be built does not stop the others.

    Args:
        path: a ``.toml`` file of ``[[object]]`` tables; else CSV, with a header or as ObjectFolder
            published it.

    Raises:
        WrongUse: no such file, a TOML file with a mistake, or a file without any object.
    """
    require_file(path, "catalogue", "say a .csv or .toml file")
    is_toml = path.suffix.lower() == ".toml"
    cells, notes = (read_toml_rows(path), ()) if is_toml else read_csv_rows(path)
    rows: list[CatalogueRow] = []
    excluded: list[ExcludedRow] = []
    for where, row in cells:
        try:
            rows.append(_row(row))
        except RowRefused as refused:
            name = row.get("name", "").strip() or where
            # Lines of a report begin with it.
            excluded.append(ExcludedRow(" ".join(name.splitlines()), f"{where}: {refused}"))
    if not rows and not excluded:
        raise WrongUse(f"{path} lists no object; write a row of {', '.join(PUBLISHED)} for each")
    count = Counter(row.name.lower() for row in rows)
    unique = tuple(row for row in rows if count[row.name.lower()] == 1)
    again = tuple(
        ExcludedRow(row.name, f"{count[row.name.lower()]} rows have the name {row.name}; give each its own")
        for row in rows
        if count[row.name.lower()] > 1
    )
    return Catalogue(path, unique, (*excluded, *again), (*notes, *_notes(unique)))


def of_materials(catalogue: Catalogue, names: Iterable[str]) -> Catalogue:
    """The rows of some materials; all where none is named.

    Raises:
        WrongUse: a material that is none of the seven.
    """
    wanted = {name.strip().lower() for name in names}
    for name in sorted(wanted - set(MATERIALS)):
        raise WrongUse(f"no material {name!r}; {nearest(name, MATERIALS)}")
    rows = tuple(row for row in catalogue.rows if not wanted or row.material in wanted)
    return replace(catalogue, rows=rows)


def _row(cells: dict[str, str]) -> CatalogueRow:
    # An object may be named none; of any other cell that says that there is nothing in it.
    given = {
        name: cell for name, cell in cells.items() if name == "name" or cell.strip().lower() not in _NOTHING
    }
    if "more" in given:
        raise RowRefused(f"more cells than columns ({given['more']!r}); quote a cell that holds a comma")
    name = given.get("name", "")
    if not _NAME.fullmatch(name):
        raise RowRefused(
            f"name {name!r} cannot name a folder; use letters, digits, . _ - and at most 80 of them"
        )
    material = given.get("material", "").lower()
    if material not in MATERIALS:
        raise RowRefused(
            f"material {given.get('material', '')!r} is not known; {nearest(material, MATERIALS)}"
        )
    return CatalogueRow(
        name=name,
        material=material,
        number=given.get("number", ""),
        scale=_positive(given, "scale_m", "m"),
        mesh=given.get("mesh"),
        units=given.get("units"),
        wall=_positive(given, "wall_m", "m"),
        mass=_positive(given, "mass_kg", "kg"),
        licence=given.get("licence", "unknown"),
        source=given.get("source"),
        up_axis=given.get("up_axis"),
    )


def _positive(given: dict[str, str], column: str, unit: str) -> float | None:
    if column not in given:
        return None
    comma = _COMMA.fullmatch(given[column])
    if comma and len(comma["decimals"]) == 3 and comma["whole"].lstrip("+0"):
        raise RowRefused(
            f"{column} {given[column]!r} may be {given[column].replace(',', '.')} or "
            f"{given[column].replace(',', '')} {unit}; write it with a decimal point"
        )
    try:
        value = float(given[column].replace(",", ".") if comma else given[column])
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > 0.0):
        raise RowRefused(
            f"{column} {given[column]!r} is no number of {unit} above zero; correct it or leave it out"
        )
    return value


def _notes(rows: Sequence[CatalogueRow]) -> tuple[str, ...]:
    notes = []
    without = sum(row.source is None for row in rows)
    if without:
        notes.append(f"{without} objects have no source; their licence cannot be looked up")
    urls = Counter(row.source for row in rows if row.source is not None)
    shared = sum(count for count in urls.values() if count > 1)
    if shared:
        notes.append(f"{shared} objects share a source with another; they may be one object listed twice")
    unlabelled = sum(row.scale is None for row in rows)
    if unlabelled:
        notes.append(f"{unlabelled} objects have no scale label; their meshes' own units decide")
    return tuple(notes)


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


class ObjectTable(StrictModel):
    """One object."""

    name: str  #: of the object and of its folder.
    material: str  #: one of the seven.
    number: str = ""  #: in the catalogue.
    scale: Annotated[Length, Positive] | None = None  #: the label of the object's longest side.
    mesh: str | None = None  #: a file, relative to the folder of meshes, or ``builtin:`` and a name.
    units: str | None = None  #: of the file's numbers: m, cm, mm or in.
    wall: Annotated[Length, Positive] | None = None  #: of a hollow thing of which the file has the outside.
    mass: Annotated[Annotated[float, MASS], Positive] | None = None  #: of the real object.
    licence: str = "unknown"  #: of the mesh.
    source: str | None = None  #: where the mesh comes from.
    up_axis: str | None = None  #: axis of the file that points up: x, y or z.


class CatalogueFile(StrictModel):
    """The whole file."""

    object: tuple[ObjectTable, ...] = Field(min_length=1)


def read_toml_rows(path: Path) -> list[tuple[str, dict[str, str]]]:
    """Where each object is in the file, and its values as text by the columns of a CSV catalogue.

    Raises:
        WrongUse: the file cannot be read, or has an unknown key or a quantity without its unit.
    """
    tables = load_toml(path, CatalogueFile).object
    rows = []
    for index, table in enumerate(tables):
        given = {name: value for name, value in vars(table).items() if value is not None}
        cells = {
            _COLUMNS.get(name, name): value if isinstance(value, str) else repr(value)
            for name, value in given.items()
        }
        rows.append((f"object {index + 1}", cells))
    return rows


class MeshFolder:
    """The meshes in a folder by the names of rows: files, and folders of one object each."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        entries = sorted(folder.iterdir()) if folder.is_dir() else []
        self._files = _by_stem(path for path in entries if path.is_file())
        self._folders = {path.name.lower(): path for path in entries if path.is_dir()}

    def find(self, row: CatalogueRow) -> str | None:
        """A mesh's path or ``builtin:`` name; None where there is none."""
        if row.mesh is not None:
            file = self.folder / row.mesh
            return row.mesh if row.mesh.startswith(BUILTIN) else str(file) if file.is_file() else None
        for name in filter(None, (row.name.lower(), row.number.lower())):
            path = self._files.get(name) or self._in_folder(name)
            if path is not None:
                return str(path)
        return None

    def _in_folder(self, name: str) -> Path | None:
        """The one that is named as usual, or the only one."""
        folder = self._folders.get(name)
        found = (
            {} if folder is None else _by_stem(path for path in sorted(folder.iterdir()) if path.is_file())
        )
        usual = next((found[stem] for stem in (*_OF_A_FOLDER, name) if stem in found), None)
        return usual or (next(iter(found.values())) if len(found) == 1 else None)


def with_meshes(
    rows: Iterable[CatalogueRow], folder: Path
) -> tuple[list[tuple[CatalogueRow, str]], list[ExcludedRow]]:
    """Return rows with their meshes in a folder, and those without one."""
    meshes = MeshFolder(folder)
    found: list[tuple[CatalogueRow, str]] = []
    excluded: list[ExcludedRow] = []
    for row in rows:
        mesh = meshes.find(row)
        if mesh is None:
            wanted = row.mesh or " or ".join(filter(None, (row.name, row.number)))
            reason = f"no mesh {wanted} in {folder}; name its folder with --meshes"
            excluded.append(ExcludedRow(row.name, reason))
        else:
            found.append((row, mesh))
    return found, excluded


def _by_stem(paths: Iterable[Path]) -> dict[str, Path]:
    """Mesh files by their names without suffix, in lower case; of several that of the first suffix."""
    meshes = [path for path in paths if path.suffix.lower() in SUFFIXES]
    meshes.sort(key=lambda path: SUFFIXES.index(path.suffix.lower()), reverse=True)
    return {path.stem.lower(): path for path in meshes}
