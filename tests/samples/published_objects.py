"""Folders of imported networks, made from tables without torch."""

from pathlib import Path
from typing import Any

from harness.authoring.published.imported import gathered, written
from harness.authoring.published.layout import format_of
from harness.objectfile.entries import Source
from harness.objectfile.published.entries import Bounds
from harness.objectfile.published.folder import PublishedObject


def imported_object(
    tree: dict[str, Any], folder: Path, audio: Bounds | None = None, touch: Bounds | None = None
) -> PublishedObject:
    """The folder of a published file's tables; bounds are those of version 1.0."""
    kind = format_of(tree, "mug.pth")
    source = Source(what=f"ObjectFile of {kind}", origin="mug.pth", licence="none", sha256="0" * 64)
    return written(gathered(tree, "mug.pth", kind, audio, touch), kind, source, "mug", folder)
