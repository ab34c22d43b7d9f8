"""The force of a live reading, for ``touchstone depth --force``."""

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from harness.commands import options
from harness.commands.force_options import described, noted, require_force, sentence, stiffness

if TYPE_CHECKING:
    from harness.bench.sensor import TactileSensor
    from harness.sim.gel.elastic import GelElastic
    from harness.sim.optics.depth_reading import DepthReading


@dataclass(frozen=True)
class ForceAsked:
    """What is wanted of a force.

    Attributes:
        thickness: metres of the gel.
        gel: how stiff it is.
    """

    thickness: float
    gel: "GelElastic"


def asked(
    force: bool,
    thickness: str | None,
    modulus: str | None,
    share: str | None,
    poisson: float | None,
    sensor: "TactileSensor | None",
) -> ForceAsked | None:
    """What the options ask for; None where they ask for no force.

    Raises:
        WrongUse: options of a force without ``--force``, or a gel of which nobody says how thick it is.
    """
    from harness.basics.errors import WrongUse
    from harness.basics.quantities import LENGTH

    require_force(force, [], modulus, share, **{"--thickness": thickness, "--gel-poisson": poisson})
    if not force:
        return None
    found = options.positive("--thickness", thickness, LENGTH)
    if found is None:
        if sensor is None:
            raise WrongUse(
                "a force needs to know how thick the gel is: --thickness 2.5mm, a --sensor or a --station"
            )
        found = sensor.gel_thickness
    return ForceAsked(found, stiffness(modulus, share, poisson))


def answer_force(wanted: ForceAsked | None, read: "DepthReading") -> dict[str, Any]:
    """Keys of the answer, as ``sim touch`` has them, and ``notes`` and ``seconds`` of the force alone."""
    if wanted is None:
        return {"force_n": None, "force_uncertainty_n": None, "force": None, "notes": [], "seconds": None}
    from harness.effects.reading_force import read_force

    began = time.process_time()
    found = read_force(read, wanted.thickness, wanted.gel)
    took = time.process_time() - began
    bound = bool(found.pressed.lower_bound[0]) or not read.anchored
    said = described(found.pressed, "layer", wanted.gel, bound)
    said["uncertainty_shares"]["reading"] = found.reading
    return {
        "force_n": found.newtons,
        "force_uncertainty_n": found.uncertainty,
        "force": {**said, "thickness_m": wanted.thickness},
        "notes": noted(found.pressed, wanted.gel, bound),
        "seconds": took,
    }


def say_force(answer: dict[str, Any]) -> list[str]:
    """For people; nothing where no force was asked for."""
    if answer["force_n"] is None:
        return []
    return [sentence(answer["force_n"], answer["force_uncertainty_n"])]
