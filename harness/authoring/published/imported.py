"""A published ObjectFile into a folder of ours: ``object.json``, graphs, and what the file does not hold."""

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from harness.authoring.published.layout import FileTable, format_of
from harness.authoring.published.look import take_first_look, take_look
from harness.authoring.published.reader import read_container, sha256_of
from harness.authoring.published.senses import (
    ImportedParts,
    take_colours,
    take_depths,
    take_gains,
    take_spectra,
)
from harness.basics.code_version import content_hash
from harness.basics.errors import WrongUse
from harness.objectfile.entries import Provenance, Source
from harness.objectfile.published.entries import Bounds, Format
from harness.objectfile.published.folder import PublishedObject, create_published
from harness.objects.builtin import DESCRIPTION

LICENCE = "CC BY 4.0, as ObjectFolder publishes its ObjectFiles; the scanned mesh keeps its own licence"

_EVERY = [
    "the object's mesh and material, so that no run and no other command than `object render queries` uses it"
]


def import_published(
    path: Path,
    out: Path,
    name: str | None = None,
    licence: str = LICENCE,
    audio_bounds: Bounds | None = None,
    touch_bounds: Bounds | None = None,
) -> PublishedObject:
    """Read a published ObjectFile and write it as a folder of ours.

    Args:
        path: of the ``.pth`` file.
        out: the folder, made.
        name: of the object; None for the file's.
        licence: of the file.
        audio_bounds: voxels, least and greatest coordinate that 1.0's sound was normalised by.
        touch_bounds: m, the same of 1.0's touch.

    Raises:
        WrongUse: there is no such file, the folder holds an object, torch is missing, or bounds that 2.0 has
        itself. DataRefused: the file is foreign, damaged, or not of a layout that is known.
    """
    if (out / DESCRIPTION).exists():
        raise WrongUse(f"{out} holds an object already; name another folder, or delete that one")
    tree = read_container(path)
    kind = format_of(tree, path.name)
    source = Source(what=f"ObjectFile of {kind}", origin=path.name, licence=licence, sha256=sha256_of(path))
    parts = gathered(tree, path.name, kind, audio_bounds, touch_bounds)
    return written(parts, kind, source, name or path.stem, out)


def written(parts: ImportedParts, kind: Format, source: Source, name: str, out: Path) -> PublishedObject:
    """The folder of what was gathered.

    Args:
        parts: of a file.
        kind: of the file.
        source: the file.
        name: of the object.
        out: the folder, made.

    Raises:
        WrongUse: the folder holds an object.
        DataRefused: the parts do not hold together.
    """
    code = {__name__: content_hash(__name__)}
    described = {
        "name": name,
        "format": kind,
        "missing": (*_EVERY, *parts.missing),
        "dropped": parts.dropped,
        "provenance": Provenance(code=code, sources=(source,), licence=source.licence),
        **parts.tree,
    }
    return create_published(out, described, parts.contents)


def gathered(
    tree: Any, name: str, kind: Format, audio_bounds: Bounds | None, touch_bounds: Bounds | None
) -> ImportedParts:
    """Tables and files of everything that a file holds; arguments and errors as ``import_published``."""
    _require_bounds(kind, {"--audio-bounds": audio_bounds, "--touch-bounds": touch_bounds})
    file, into = FileTable(name, tree), ImportedParts()
    first = kind == "ObjectFolder 1.0"
    takers: dict[str, Callable[[FileTable], None]] = {
        "AudioNet": partial(take_spectra, bounds=audio_bounds, into=into)
        if first
        else partial(take_gains, into=into),
        "TouchNet": partial(take_colours, bounds=touch_bounds, into=into)
        if first
        else partial(take_depths, into=into),
        "VisionNet": partial(take_first_look if first else take_look, into=into),
    }
    for key, take in takers.items():
        if key in tree:
            take(file.part(key))
        else:
            into.missing.append(f"{key}: the file has no such network")
    return into


def _require_bounds(kind: Format, bounds: Mapping[str, Bounds | None]) -> None:
    for option, pair in bounds.items():
        if pair is not None and kind == "ObjectFolder 2.0":
            raise WrongUse(
                f"{option} is for ObjectFolder 1.0; files of 2.0 hold their own bounds, and this is one"
            )
        if pair is not None and not pair[0] < pair[1]:
            raise WrongUse(
                f"{option} {pair[0]:g} {pair[1]:g}: the least coordinate comes first, then the greatest"
            )
