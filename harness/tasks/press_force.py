"""The force of a press in a result, with its error and what it rests on."""

from collections.abc import Mapping
from dataclasses import dataclass

from harness.effects.touch_press import Press
from harness.sim.gel.contact_force import CHECKED, PARTS, ContactForce
from harness.sim.gel.elastic import NOT_MEASURED, GelElastic

FORCE_LEVEL = "touch.force"
"""Knob of the model of the force."""


@dataclass(frozen=True)
class PressForce:
    """The details of a computed force."""

    level: str  #: model: ``"layer"``, ``"winkler"`` or ``"table"``.
    uncertainty_shares: Mapping[str, float]  #: standard deviations by cause, as fractions of the force.
    centre_m: tuple[float, ...] | None  #: centre of pressure in the gel's frame; None without a force.
    largest_pressure_pa: float | None  #: None for a measured force.
    depth_share: float  #: depth over the gel's thickness.
    strain: float  #: depth over the contact radius.
    lower_bound: bool  #: whether part of the contact is not seen or has no height.
    beyond_checked: bool  #: whether the press is deeper than the model was checked to.
    young_pa: float | None  #: modulus of the gel; None for a measured force.
    poisson: float | None
    source: str | None  #: of the modulus, or of the table of measured forces.
    thickness_m: float | None = None  #: of the gel, where it was an input.


def describe_force(
    found: ContactForce, level: str, gel: GelElastic | None, bound: bool, source: str | None = None
) -> PressForce:
    """Describe the force of one press.

    Args:
        found: of one press.
        level: model of the force.
        gel: its stiffness; None if the force was read from a table of measured forces.
        bound: whether part of the contact is not seen or has no height.
        source: of the table.
    """
    return PressForce(
        level=level,
        uncertainty_shares=dict(zip(PARTS, found.shares[0].tolist(), strict=True)),
        centre_m=tuple(found.centre[0].tolist()) if found.newtons[0] > 0.0 else None,
        largest_pressure_pa=None if gel is None else float(found.pressure[0].max()),
        depth_share=float(found.depth_share[0]),
        strain=float(found.strain[0]),
        lower_bound=bound,
        beyond_checked=gel is not None and bool(found.beyond_checked[0]),
        young_pa=None if gel is None else gel.young,
        poisson=None if gel is None else gel.poisson,
        source=source if gel is None else gel.source,
    )


def force_notes(found: ContactForce, gel: GelElastic | None, bound: bool) -> list[str]:
    """Return warnings about the force of one press; the arguments are those of ``describe_force``."""
    if found.newtons[0] == 0.0:
        return []
    notes = []
    if bound:
        notes.append("the force is a lower bound: what is not seen, or has no height, presses as well")
    if gel is None:
        return notes
    if found.beyond_checked[0]:
        notes.append(
            f"the press is {found.depth_share[0]:.2f} thicknesses and {found.strain[0]:.2f} contact radii "
            f"deep; the force is that of a linear gel, checked to {CHECKED[0]:g} and {CHECKED[1]:g}, and its "
            "uncertainty does not count what is beyond"
        )
    if gel.source == NOT_MEASURED.source:
        notes.append(
            "the modulus of this gel was not measured: press a known object with a known force, and say "
            f"--gel-modulus, {gel.young:g} Pa times measured over computed"
        )
    return notes


def force_of_press(press: Press) -> tuple[float | None, float | None, PressForce | None, list[str]]:
    """Return newtons, their standard deviation, details and warnings; None where no force was computed."""
    found = press.force
    if found is None:
        return None, None, None, []
    level = str(press.plan.levels[FORCE_LEVEL])
    gel = None if level == "table" else press.gel.elastic
    table = press.gel.forces
    source = (
        None if table is None else f"{table.indenter} on {table.sensor} {table.serial}: {table.made_from}"
    )
    missing = press.missing is not None and bool(press.missing.any())
    bound = missing or bool(found.lower_bound[0])
    force = describe_force(found, level, gel, bound, source)
    return float(found.newtons[0]), float(found.uncertainty[0]), force, force_notes(found, gel, bound)


def force_sentence(newtons: float, uncertainty: float) -> str:
    """State a force and its standard deviation."""
    return f"pressed with {newtons:.3g} N (one standard deviation {uncertainty:.2g} N)"
