"""The settings of a folder's last build: which catalogue, which objects, which rows were excluded and why."""

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from pydantic import Field

from harness.authoring.catalogue.layout import BuildFolder
from harness.authoring.catalogue.rows import ExcludedRow
from harness.basics.files.json_file import read_model, write_model
from harness.basics.toml_file import StrictModel


class ExcludedEntry(StrictModel):
    """A row that was not built, and why."""

    name: str
    reason: str


class BuildSettings(StrictModel):
    """The last build of a folder.

    Attributes:
        schema_version: of this file.
        catalogue: path of its file.
        names: of the objects, in the catalogue's order.
        excluded: rows that were not built.
    """

    schema_version: Literal[1] = Field(default=1, alias="schema")
    catalogue: str
    names: tuple[str, ...]
    excluded: tuple[ExcludedEntry, ...] = ()


def write_settings(
    of: BuildFolder, catalogue: Path, names: Sequence[str], excluded: Sequence[ExcludedRow]
) -> None:
    """Note what is built now."""
    entries = tuple(ExcludedEntry(name=row.name, reason=row.reason) for row in excluded)
    write_model(BuildSettings(catalogue=str(catalogue), names=tuple(names), excluded=entries), of.settings)


def read_settings(of: BuildFolder) -> BuildSettings:
    """What was noted last.

    Raises:
        WrongUse: nothing was built into the folder.
        CalibrationRefused: the file is damaged.
    """
    advice = "name the --out folder of `touchstone catalogue build`"
    return read_model(of.settings, BuildSettings, "build of a catalogue", advice)
