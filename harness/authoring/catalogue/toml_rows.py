"""A catalogue in TOML: one ``[[object]]`` table each, quantities with their units."""

from pathlib import Path
from typing import Annotated

from pydantic import Field

from harness.basics.quantities import MASS, Length, Positive
from harness.basics.toml_file import StrictModel, load_toml


class ObjectTable(StrictModel):
    """One object.

    Attributes:
        name: of the object and of its folder.
        material: one of the seven.
        number: in the catalogue.
        scale: the label of the object's longest side.
        mesh: a file, relative to the folder of meshes, or ``builtin:`` and a name.
        units: of the file's numbers: m, cm, mm or in.
        wall: of a hollow thing of which the file has the outside.
        mass: of the real object.
        licence: of the mesh.
        source: where the mesh comes from.
        up_axis: axis of the file that points up: x, y or z.
    """

    name: str
    material: str
    number: str = ""
    scale: Annotated[Length, Positive] | None = None
    mesh: str | None = None
    units: str | None = None
    wall: Annotated[Length, Positive] | None = None
    mass: Annotated[Annotated[float, MASS], Positive] | None = None
    licence: str = "unknown"
    source: str | None = None
    up_axis: str | None = None


class CatalogueFile(StrictModel):
    """The whole file."""

    object: tuple[ObjectTable, ...] = Field(min_length=1)


_COLUMNS = {"scale": "scale_m", "wall": "wall_m", "mass": "mass_kg"}


def read_toml_rows(path: Path) -> list[tuple[str, dict[str, str]]]:
    """Where each object is in the file, and its values as text by the columns of a CSV catalogue.

    Raises:
        WrongUse: the file cannot be read, or has an unknown key or a quantity without its unit.
    """
    tables = load_toml(path, CatalogueFile).object
    return [(f"object {index + 1}", _as_cells(table)) for index, table in enumerate(tables)]


def _as_cells(table: ObjectTable) -> dict[str, str]:
    given = {name: value for name, value in vars(table).items() if value is not None}
    return {
        _COLUMNS.get(name, name): value if isinstance(value, str) else repr(value)
        for name, value in given.items()
    }
