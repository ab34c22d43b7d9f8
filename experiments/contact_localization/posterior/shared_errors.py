"""Errors that all contacts of a run share, as unknowns beside place and yaw.

An object that stands a little crooked, or is a little larger than its model, and a gel that is not quite
where the tool's description says, move every contact at once. Taken as independent errors of each contact
they would have to be wide, and every contact's place would say little; named, what is left to each is the
arm's own error, and contacts together tell what they share as far as it can be told.
"""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import BoolArray, FloatArray
from harness.bench.bench_errors import USUAL

UNKNOWNS = 6
"""Tilt about base x and y, scale, and the gel's centre in its own frame, each in units of its sigma."""


@dataclass(frozen=True)
class SharedNoise:
    """One sigma of what contacts share, and of what is left to each.

    Attributes:
        tilt: rad, of the object about base x and about base y.
        scale: of the object's true size over its model's, less 1.
        gel_centre: metres, of the gel's centre along each axis of its own frame.
        shift: metres, left to each contact in the plane of the gel: the arm, and the shape there.
        depth: metres, the same across it.
        per_metre: metres of sigma left for each metre between contacts: what a shape's
            error is not, a scale.
    """

    tilt: float = USUAL.tilt
    scale: float = USUAL.scale
    gel_centre: float = USUAL.gel_centre
    shift: float = USUAL.arm
    depth: float = USUAL.arm
    per_metre: float = 2.0e-3


def moves(noise: SharedNoise, places: FloatArray, attitudes: FloatArray, members: BoolArray) -> FloatArray:
    """``(contacts, 6, 3)`` metres in base by which a sigma of each shared error moves each contact's gel.

    Against their mean over the contacts that count: moving all alike is a hypothesis's own place, and what
    errors do beside that says little of it, so that the two are drawn apart from each other. To first order,
    of which the next is a micrometre or so at half a degree and 100 mm.

    Args:
        noise: the sigmas.
        places: ``(contacts, 3)`` metres in base, of the gel's centre.
        attitudes: ``(contacts, 3, 3)``: of the gel in base.
        members: ``(contacts,)`` whether each counts; at least one.
    """
    tilted = noise.tilt * np.cross(np.eye(3)[None, :2], places[:, None])
    turned = noise.gel_centre * np.swapaxes(attitudes, 1, 2)
    each = np.concatenate([tilted, noise.scale * places[:, None], turned], axis=1)
    return np.asarray(each - each[members].mean(axis=0))


def log_prior(shared: FloatArray | None) -> FloatArray | float:
    """``(n,)`` nats, up to a constant; 0 where nothing is named."""
    return 0.0 if shared is None else np.asarray(-0.5 * np.sum(shared**2, axis=1))
