"""Objects so small that building them takes seconds, and what is built of them."""

from pathlib import Path

import trimesh

from harness.authoring.catalogue.layout import BuildFolder
from harness.authoring.catalogue.rows import CatalogueRow
from harness.authoring.catalogue.spec import BuildSpec, build_item
from harness.authoring.catalogue.worker import Job

TOUCH = BuildSpec(("touch",), "smoke")
"""The cheapest sense."""

BOTH = BuildSpec(("audio", "touch"), "smoke", most=12, edge=0.015)


def block(folder: Path, name: str, length: float = 0.08) -> str:
    """A wooden block's file."""
    path = folder / f"{name}.stl"
    trimesh.creation.box([length, 0.05, 0.02]).export(path)
    return str(path)


def block_row(name: str, material: str = "wood") -> CatalogueRow:
    """Its row."""
    return CatalogueRow(name, material, units="m")


def tiny_job(
    folder: Path, name: str, out: BuildFolder, spec: BuildSpec = TOUCH, material: str = "wood"
) -> Job:
    """A block to be built."""
    out.prepare()
    return Job(build_item(block_row(name, material), block(folder, name), spec), spec, out)


def all_bytes(folder: Path) -> dict[str, bytes]:
    """Of every file of a folder."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
