"""``object.json``: strict, with a unit in every key that has one, made to be read by people."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, Self, TypeVar

from pydantic import Field, model_validator

from harness.basics.errors import DataRefused, WrongUse
from harness.basics.toml_file import validate
from harness.objectfile.entries import (
    AudioEntry,
    Entry,
    FileEntry,
    MaterialEntry,
    MeshEntry,
    Modality,
    NetworkEntry,
    Provenance,
)
from harness.objectfile.touch_entries import TouchEntry
from harness.objectfile.vision_entry import VisionEntry

SCHEMA = 1

PUBLISHED = "published"
"""The ``kind`` of an ``object.json`` that describes networks imported from a published file."""

M = TypeVar("M", bound=Entry)

_MOST_BYTES = 16 * 2**20
"""Of ``object.json``; a thousand modes with their self-test are a tenth of it."""


class Description(Entry):
    """All of ``object.json``."""

    schema_number: Literal[1] = Field(alias="schema")  #: ``schema`` in the file.
    name: Annotated[str, Field(min_length=1, max_length=200)]  #: of the object.
    units: Literal["m"] = "m"  #: of every length in the folder.
    frame: Literal["as the mesh"] = "as the mesh"  #: of every point in the folder.
    material: MaterialEntry  #: of the object.
    mesh: MeshEntry  #: its surface.
    provenance: Provenance  #: of the mesh.
    audio: AudioEntry | None = None  #: the sound; null until it is built.
    touch: TouchEntry | None = None  #: the touch; null until it is built.
    vision: VisionEntry | None = None  #: the look; null until it is built.

    @property
    def files(self) -> tuple[FileEntry, ...]:
        """Every file that the folder must hold, each once."""
        return self.files_of(("audio", "touch", "vision"))

    def files_of(self, senses: Sequence[Modality]) -> tuple[FileEntry, ...]:
        """Those that some senses are made of, and the mesh."""
        parts = [part for part in (self.audio, self.touch, self.vision) if part is not None]
        chosen = [part for part in parts if part.sense in senses]
        return (self.mesh, *(entry for part in chosen for entry in part.files))

    @property
    def networks(self) -> Mapping[str, NetworkEntry]:
        """By modality, those that there are."""
        audio = None if self.audio is None else self.audio.network
        codes = None if self.touch is None else self.touch.codes
        vision = None if self.vision is None else self.vision.network
        every = {"audio": audio, "touch": None if codes is None else codes.network, "vision": vision}
        return {name: entry for name, entry in every.items() if entry is not None}

    @model_validator(mode="after")
    def _own_files(self) -> Self:
        names = [entry.file for entry in self.files]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ValueError(f"{twice[0]!r} is named twice")
        return self


def read_description(path: Path) -> Description:
    """Read ``object.json``.

    Raises:
        WrongUse: it is missing, or of networks imported from a published file.
        DataRefused: it is damaged, of another schema, or says something unknown; every
            mistake is named, an unknown key with the nearest known one.
    """
    tree = read_tree(path)
    if is_published(tree):
        raise WrongUse(
            f"{path.parent} holds networks imported from a published file, which predict other quantities "
            "than a built ObjectFile's and come without mesh and material; `touchstone object info`, "
            "`object verify` and `object render queries` read it, for all else build the object from its "
            "mesh with `touchstone object build`"
        )
    return description_from(tree, str(path))


def is_published(tree: Any) -> bool:
    """Whether JSON values of an ``object.json`` are those of an imported file, by their ``kind``."""
    return isinstance(tree, dict) and tree.get("kind") == PUBLISHED


def read_tree(path: Path) -> Any:
    """The JSON values of an ``object.json`` of either kind; strict, and no larger than one is.

    Raises:
        WrongUse: it is missing.
        DataRefused: it is no JSON, or has a key twice, or a number that JSON does not know.
    """
    if not path.is_file():
        raise WrongUse(
            f"{path.parent} is no ObjectFile: there is no {path.name} in it; give its folder, or make one "
            "with `touchstone object build`"
        )
    if path.stat().st_size > _MOST_BYTES:
        raise DataRefused(f"{path} has {path.stat().st_size} bytes, more than {_MOST_BYTES}; build it again")
    try:
        return json.loads(
            path.read_text(encoding="utf-8"), parse_constant=_no_constant, object_pairs_hook=_no_twins
        )
    except (ValueError, RecursionError) as error:
        reason = f" ({error})" if isinstance(error, _Ambiguous) else ""
        if isinstance(error, json.JSONDecodeError):
            reason = f" from line {error.lineno} on"
        raise DataRefused(f"{path} is not JSON{reason}; copy it again, or build the object again") from error


def description_from(tree: Any, where: str) -> Description:
    """JSON values as a description.

    Raises:
        DataRefused: as ``read_description``.
    """
    return model_from(tree, Description, where)


def model_from(tree: Any, model: type[M], where: str) -> M:
    """JSON values as a description of either kind.

    Raises:
        DataRefused: of another schema, or what the model does not allow.
    """
    number = tree.get("schema") if isinstance(tree, dict) else None
    if type(number) is not int or number != SCHEMA:
        raise DataRefused(
            f"{where} is of schema {number!r}, this program reads {SCHEMA}; use the program that made it, "
            "or build the object again"
        )
    try:
        return validate(tree, model, where)
    except WrongUse as error:
        raise DataRefused(str(error)) from error


def description_text(description: Entry) -> str:
    """``object.json``: the same description is always the same text."""
    return _text(description.model_dump(mode="json", by_alias=True), "") + "\n"


def _text(value: Any, indent: str) -> str:
    """JSON with a line for each key, and lists of numbers on one line."""
    inner = indent + "  "
    if isinstance(value, dict) and value:
        items = [f"{inner}{json.dumps(key)}: {_text(item, inner)}" for key, item in value.items()]
        return "{\n" + ",\n".join(items) + f"\n{indent}}}"
    if isinstance(value, list) and any(isinstance(item, dict | list) for item in value):
        return "[\n" + ",\n".join(inner + _text(item, inner) for item in value) + f"\n{indent}]"
    return json.dumps(value, allow_nan=False, ensure_ascii=False)


class _Ambiguous(ValueError):
    """What Python's reader takes and other programs read in another way, or not at all."""


def _no_constant(text: str) -> Any:
    raise _Ambiguous(f"{text} is no number of JSON")


def _no_twins(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    tree = dict(pairs)
    if len(tree) != len(pairs):
        names = [name for name, _ in pairs]
        raise _Ambiguous(f"the key {next(n for n in names if names.count(n) > 1)!r} is there twice")
    return tree
