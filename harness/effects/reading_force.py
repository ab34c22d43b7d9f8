"""With how much force a gel is pressed, from the surface that was read of its picture.

The gel lies where the object is that presses it, so that the force which the object would take is asked of
the surface itself (``tests/harness/sim/gel/test_contact_force.py`` shows that they are the same). Two things
are
added to what a force is off by: the reading's own error, and where the gel is taken to be pressed.
"""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import FloatArray
from harness.effects.force_effects import pressed_of_gel
from harness.sim.gel.contact_force import ContactForce, ForceLevel, contact_force
from harness.sim.gel.elastic import GelElastic
from harness.sim.optics.depth_reading import DepthReading

_OTHER_SHARES = (0.05, 0.2)
"""Of the deepest pixel, from which the gel might be taken to be pressed as well."""


@dataclass(frozen=True, eq=False)
class ReadForce:
    """The force of one reading.

    Attributes:
        pressed: all but the reading's own error, of one press.
        reading: share of the force, one standard deviation: what the reading is off by.
        newtons: exactly 0 where nothing was seen to press.
        uncertainty: N, one standard deviation.
    """

    pressed: ContactForce
    reading: float
    newtons: float
    uncertainty: float


def read_force(
    read: DepthReading, thickness: float, gel: GelElastic, level: ForceLevel = "layer"
) -> ReadForce:
    """The force of a press that was read.

    Args:
        read: surface and error.
        thickness: metres of the gel.
        gel: how stiff it is.
        level: how it is computed; what the reading adds is computed by springs.

    Raises:
        OutOfDomain: the reading is deeper than the gel is thick.
    """
    surface = read.height if read.contact.any() else np.zeros_like(read.height)
    pressed = contact_force(pressed_of_gel(surface)[None], read.pitch, thickness, gel, level)
    newtons = float(pressed.newtons[0])
    if newtons == 0.0:
        return ReadForce(pressed, 0.0, 0.0, 0.0)

    def springs(depth: FloatArray) -> float:
        held = np.clip(depth, 0.0, thickness)
        return float(contact_force(held[None], read.pitch, thickness, gel, "winkler").newtons[0])

    middle = pressed_of_gel(surface)
    here = springs(middle)
    high, low = (springs(np.where(middle > 0.0, surface + by * read.sigma, 0.0)) for by in (1.0, -1.0))
    by_error = (high - low) / (2.0 * here)
    more, less = (springs(pressed_of_gel(surface, share)) for share in _OTHER_SHARES)
    reading = float(np.hypot(by_error, (more - less) / (2.0 * here)))
    return ReadForce(pressed, reading, newtons, float(np.hypot(pressed.uncertainty[0], newtons * reading)))
