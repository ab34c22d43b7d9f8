"""Folders of imported networks: committed ones, and fresh ones where torch is installed.

``published/exported`` was written by ``main`` below, ``published/hand_built`` by the importer of commit
bc239515, which built its graphs without torch's exporter; both from the trees of ``TREES``.
"""

import json
import shutil
from pathlib import Path
from typing import Any

from harness.objectfile.entries import Source
from harness.objectfile.published.entries import Bounds, PublishedObject
from tests.samples import published_trees

AUDIO_BOUNDS: Bounds = (2.0, 21.0)
TOUCH_BOUNDS: Bounds = (-0.07, 0.13)
TREES = {
    "kilo": lambda: published_trees.second(),
    "osf": lambda: published_trees.second(1, prefix="", vectors=False, kilo=False),
    "first": lambda: published_trees.first(2),
}
"""A KiloOSF of 2.0, a coarse and a fine OSF of 2.0, and a file of 1.0, by the names of their folders."""

_FOLDER = Path(__file__).parent / "published"


def committed_object(name: str, made_by: str = "exported") -> PublishedObject:
    """Open the folder that was imported from a tree of ``TREES``."""
    return PublishedObject.open(_FOLDER / made_by / name)


def imported_object(
    tree: dict[str, Any], folder: Path, audio: Bounds | None = None, touch: Bounds | None = None
) -> PublishedObject:
    """Import a published file's tables with torch; bounds are those of version 1.0."""
    from harness.authoring.published.imported import gathered, write_parts
    from harness.authoring.published.layout import format_of

    kind = format_of(tree, "mug.pth")
    source = Source(what=f"ObjectFile of {kind}", origin="mug.pth", licence="none", sha256="0" * 64)
    return write_parts(gathered(tree, "mug.pth", kind, audio, touch), kind, source, "mug", folder)


def without_bounds(folder: Path) -> PublishedObject:
    """Copy the committed object of 1.0 as if its bounds had not been given at the import."""
    shutil.copytree(committed_object("first").folder, folder)
    tree = json.loads((folder / "object.json").read_text())
    tree["audio_spectrum"]["bounds"] = tree["touch_colours"]["bounds_m"] = None
    (folder / "object.json").write_text(json.dumps(tree))
    return PublishedObject.open(folder)


def import_tree(name: str, folder: Path) -> PublishedObject:
    """Import a tree of ``TREES`` with torch."""
    bounds = (AUDIO_BOUNDS, TOUCH_BOUNDS) if name == "first" else (None, None)
    return imported_object(TREES[name](), folder, *bounds)


def main() -> None:
    """Write the committed folders again."""
    for name in TREES:
        import_tree(name, _FOLDER / "exported" / name)


if __name__ == "__main__":
    main()
