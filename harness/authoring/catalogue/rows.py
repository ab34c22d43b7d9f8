"""A catalogue of objects: rows of a CSV or TOML file, and the rows that cannot be built, with reasons."""

import math
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from harness.authoring.catalogue.csv_rows import PUBLISHED, read_csv_rows
from harness.authoring.catalogue.toml_rows import read_toml_rows
from harness.basics.errors import WrongUse
from harness.basics.files.named_file import nearest, require_file
from harness.basics.materials import MATERIALS

_NOTHING = ("", "none", "null", "nan", "n/a")
_COMMA = re.compile(r"(?P<whole>\+?\d*),(?P<decimals>\d+)(?:[eE][+-]?\d+)?")
"""A number with a decimal comma; with three decimals the comma may also separate thousands."""

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,79}")


@dataclass(frozen=True)
class CatalogueRow:
    """One object as its catalogue describes it.

    Attributes:
        name: of the object, and of its folder; unique in the catalogue.
        material: one of the seven, in lower case.
        number: in the catalogue, as published; "" where it has none.
        scale: m, the label of the object's longest side; None where it has none.
        mesh: a file, relative to the folder of meshes, or ``builtin:`` and a name; None to search for one.
        units: of the file's numbers; None where the file or the label decides.
        wall: m, of a hollow thing of which the file has the outside.
        mass: kg, of the real object; None where nobody weighed it.
        licence: of the mesh.
        source: where the mesh comes from; None where the catalogue does not say.
        up_axis: axis of the file that points up; None for the one that it declares, else z.
    """

    name: str
    material: str
    number: str = ""
    scale: float | None = None
    mesh: str | None = None
    units: str | None = None
    wall: float | None = None
    mass: float | None = None
    licence: str = "unknown"
    source: str | None = None
    up_axis: str | None = None


@dataclass(frozen=True)
class ExcludedRow:
    """A row that is not built.

    Attributes:
        name: of the object, or of the line where it has none.
        reason: a sentence with the value, the limit, and what to do.
    """

    name: str
    reason: str


@dataclass(frozen=True)
class Catalogue:
    """What a catalogue's file lists.

    Attributes:
        path: of the file.
        rows: in their order.
        excluded: rows that cannot be built.
        notes: on the file as a whole, a sentence each.
    """

    path: Path
    rows: tuple[CatalogueRow, ...]
    excluded: tuple[ExcludedRow, ...]
    notes: tuple[str, ...]


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
    unique, again = _unique(rows)
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


def _unique(rows: Sequence[CatalogueRow]) -> tuple[tuple[CatalogueRow, ...], tuple[ExcludedRow, ...]]:
    # Two names that differ by case are one folder on some file systems.
    count = Counter(row.name.lower() for row in rows)
    unique = tuple(row for row in rows if count[row.name.lower()] == 1)
    again = tuple(
        ExcludedRow(row.name, f"{count[row.name.lower()]} rows have the name {row.name}; give each its own")
        for row in rows
        if count[row.name.lower()] > 1
    )
    return unique, again


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
