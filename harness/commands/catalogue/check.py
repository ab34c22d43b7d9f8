"""``touchstone catalogue check``: what intake finds of every object, before anything is built."""

from collections import Counter
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from harness.commands import options
from harness.commands.catalogue import chosen
from harness.commands.output import ANSWERS, emit, share_progress, warn

if TYPE_CHECKING:
    from harness.authoring.catalogue.findings import IntakeFinding
    from harness.authoring.catalogue.rows import Catalogue, CatalogueRow, ExcludedRow


def check(
    catalogue: chosen.CatalogueFileArgument,
    meshes: chosen.Meshes = None,
    material: chosen.Materials = None,
    senses: chosen.Senses = "audio,touch",
    rows_only: Annotated[
        bool, typer.Option("--rows-only", help="Look at the catalogue's rows, and open no mesh.")
    ] = False,
    json: options.Json = False,
) -> int:
    """Report on every object: units, scale label against the mesh, openings, thin walls, implied mass.

    Nothing is written. A row that cannot be built is excluded with its reason, and does not stop the others.
    A scale label decides the unit of a mesh that does not state one. Exit code 0 where at least one object
    can be built, else 1.

    Try: touchstone catalogue check objects.csv --meshes meshes --material ceramic
    """
    chosen_rows, rows, excluded = chosen.read(catalogue, meshes, material)
    for note in chosen_rows.notes:
        warn(note)
    found = []
    if not rows_only:
        from harness.authoring.catalogue.findings import intake_finding

        with share_progress() as report:
            for index, (row, mesh) in enumerate(rows):
                report(row.name, index / len(rows))
                found.append(intake_finding(row, mesh, "audio" in senses.split(",")))
    if json:
        emit(_as_json(chosen_rows, rows, excluded, found))
    else:
        _print(chosen_rows, rows, excluded, found)
    buildable = len(rows) if rows_only else sum(finding.reason is None for finding in found)
    return 0 if buildable else 1


def _as_json(
    catalogue: "Catalogue",
    rows: "list[tuple[CatalogueRow, str]]",
    excluded: "tuple[ExcludedRow, ...]",
    found: "list[IntakeFinding]",
) -> dict[str, Any]:
    return {
        "schema": 1,
        "catalogue": str(catalogue.path),
        "objects": len(catalogue.rows),
        "with_mesh": len(rows),
        "materials": dict(Counter(row.material for row in catalogue.rows)),
        "notes": list(catalogue.notes),
        "excluded": [asdict(row) for row in excluded],
        "intake": [
            {
                "name": each.name,
                "material": each.material,
                "mesh": each.mesh,
                "verdict": _verdict(each),
                "reason": each.reason,
                "remarks": list(each.remarks),
                "units": each.units,
                "longest_side_m": each.longest_side,
                "label_m": each.label,
                "watertight": each.watertight,
                "faces": each.faces,
                "wall_m": each.wall,
                "mass_kg": each.mass,
            }
            for each in found
        ],
    }


def _verdict(found: "IntakeFinding") -> str:
    if found.reason is not None:
        return "excluded"
    return "look" if found.remarks else "ready"


def _print(
    catalogue: "Catalogue",
    rows: "list[tuple[CatalogueRow, str]]",
    excluded: "tuple[ExcludedRow, ...]",
    found: "list[IntakeFinding]",
) -> None:
    if found:
        ANSWERS.print(_table(found))
    for finding in found:
        for sentence in filter(None, (finding.reason, *finding.remarks)):
            ANSWERS.print(f"{finding.name}: {sentence}", markup=False)
    for row in excluded[:_LISTED]:
        ANSWERS.print(f"{row.name}: excluded, {row.reason}", markup=False)
    if len(excluded) > _LISTED:
        ANSWERS.print(f"and {len(excluded) - _LISTED} more excluded; --json lists them all")
    counts = Counter(_verdict(finding) for finding in found)
    verdicts = ", ".join(f"{counts[name]} {name}" for name in ("ready", "look", "excluded") if counts[name])
    materials = ", ".join(
        f"{name} {n}" for name, n in Counter(r.material for r in catalogue.rows).most_common()
    )
    ANSWERS.print(
        f"{len(catalogue.rows)} objects ({materials}), {len(rows)} with a mesh; {verdicts or 'none opened'}"
    )


_LISTED = 20


def _table(found: "list[IntakeFinding]") -> Table:
    drawn = Table(title="intake")
    for heading in ("object", "material", "verdict", "units", "longest", "label", "closed", "wall", "mass"):
        drawn.add_column(heading, no_wrap=True)
    for each in found:
        drawn.add_row(
            each.name,
            each.material,
            _verdict(each),
            each.units or "",
            _number(each.longest_side, 1.0, "m"),
            _number(each.label, 1.0, "m"),
            "" if each.watertight is None else "yes" if each.watertight else "no",
            _number(each.wall, 1e3, "mm"),
            _number(each.mass, 1.0, "kg"),
        )
    return drawn


def _number(value: float | None, factor: float, unit: str) -> str:
    return "" if value is None else f"{value * factor:.3g} {unit}"
