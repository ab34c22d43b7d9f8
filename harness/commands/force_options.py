"""Options of a press that ask for its force, each described once, and what is answered of it."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from harness.commands import options

if TYPE_CHECKING:
    from harness.effects.touch_press import Press
    from harness.sim.gel.contact_force import ForceTable
    from harness.sim.gel.elastic import GelElastic

Force = Annotated[
    bool,
    typer.Option(
        "--force",
        help="How hard the gel is pressed as well, in N, with its error: docs/explanation/touch_force.md.",
    ),
]
Modulus = Annotated[
    str | None,
    typer.Option(
        "--gel-modulus",
        help="Young's modulus of the gel, as 0.2MPa. Left out: 0.255MPa give or take 53 %, for nobody has "
        "published this gel's. Forces go as it.",
        metavar="PRESSURE",
    ),
]
ModulusError = Annotated[
    str | None,
    typer.Option(
        "--gel-modulus-error", help="One standard deviation of --gel-modulus, as 5%.", metavar="SHARE"
    ),
]
Poisson = Annotated[
    float | None,
    typer.Option("--gel-poisson", help="Poisson's ratio of the gel, 0 to 0.5; 0.485 if left out."),
]
Table = Annotated[
    Path | None,
    typer.Option(
        "--force-table", help="Forces measured on this gel, in place of its modulus.", metavar="FILE.json"
    ),
]
PressureOut = Annotated[
    Path | None,
    typer.Option("--pressure-out", help="Pascals of every pixel.", metavar="FILE.npy"),
]

LEVEL = "touch.force"


def require_force(
    force: bool, levels: Sequence[str], modulus: str | None, share: str | None, **others: object
) -> None:
    """``WrongUse`` for options of a force that is not asked for, or that contradict each other."""
    from harness.basics.errors import WrongUse

    named = {"--gel-modulus": modulus, "--gel-modulus-error": share, **others}
    idle = [option for option, value in named.items() if value is not None]
    idle += [text for text in levels if text.startswith(LEVEL)]
    if idle and not force:
        raise WrongUse(f"{idle[0]} is of a force, and none is asked for; add --force, or leave it out")
    if (modulus is None) != (share is None):
        raise WrongUse(
            "a modulus and how well it is known go together; say both, as --gel-modulus 0.2MPa "
            "--gel-modulus-error 10%"
        )


def stiffness(modulus: str | None, share: str | None, poisson: float | None) -> "GelElastic":
    """The gel that the options describe, the one that nobody measured where they say nothing."""
    from dataclasses import replace

    from harness.basics.quantities import PRESSURE, RATIO
    from harness.sim.gel.elastic import NOT_MEASURED, GelElastic

    gel = NOT_MEASURED
    if modulus is not None:
        young = options.quantity("--gel-modulus", modulus, PRESSURE)
        gel = GelElastic(young, options.quantity("--gel-modulus-error", share or "", RATIO))
    return gel if poisson is None else replace(gel, poisson=poisson)


def measured(table: Path | None, levels: list[str]) -> "tuple[ForceTable | None, list[str]]":
    """The table of forces, and the levels, with the one that reads it where no other is chosen."""
    from harness.sim.gel.contact_force import read_force_table

    if table is None:
        return None, levels
    chosen = any(text.partition("=")[0].strip() == LEVEL for text in levels)
    return read_force_table(table), levels if chosen else [*levels, f"{LEVEL}=table"]


def force_json(press: "Press") -> dict[str, Any]:
    """``force_n``, ``force_uncertainty_n`` and ``force``; each null where none was asked for."""
    from harness.basics.result import json_value
    from harness.tasks.press_force import describe_force

    found = press.force
    if found is None:
        return {"force_n": None, "force_uncertainty_n": None, "force": None}
    level = str(press.plan.levels[LEVEL])
    gel = None if level == "table" else press.gel.elastic
    table = press.gel.forces
    source = (
        None if table is None else f"{table.indenter} on {table.sensor} {table.serial}: {table.made_from}"
    )
    said = describe_force(found, level, gel, lower_bound(press), source)
    return {
        "force_n": float(found.newtons[0]),
        "force_uncertainty_n": float(found.uncertainty[0]),
        "force": {name: json_value(value) for name, value in vars(said).items() if name != "thickness_m"},
    }


def lower_bound(press: "Press") -> bool:
    """Whether there is more of the contact than is seen, or than the map has heights for."""
    found = press.force
    missing = press.missing is not None and bool(press.missing.any())
    return found is not None and (bool(found.lower_bound[0]) or missing)


def press_force_notes(press: "Press") -> list[str]:
    """What the operator should know of the force."""
    from harness.tasks.press_force import force_notes

    if press.force is None:
        return []
    gel = None if press.plan.levels[LEVEL] == "table" else press.gel.elastic
    return force_notes(press.force, gel, lower_bound(press))


def force_row(press: "Press") -> str | None:
    """For people; None where none was asked for."""
    from harness.tasks.press_force import force_sentence

    found = press.force
    return None if found is None else force_sentence(float(found.newtons[0]), float(found.uncertainty[0]))
