"""Presses that the fit shows not to be this ball: larger than it, or of other colours."""

import numpy as np

from calibration.taxim.held_out import WITHIN, FittedModel, decibels
from calibration.taxim.pack import PressPack
from calibration.taxim.pictures import Refused
from calibration.taxim.smooth_fit import residual, strength_by_radius
from harness.basics.arrays import FloatArray

LEAST_OWN_GAIN = 6.0
"""dB that a press must gain in its own fit: less than half of its change explained away is not the ball's."""


def too_large(name: str, radius: float, ball: float, what: str) -> Refused | None:
    """Refuse a press whose ``what`` is no smaller than the ball; both in pixels."""
    if radius < ball:
        return None
    return Refused(
        name,
        "radius",
        f"{what} has a radius of {radius:.1f} px and the ball one of {ball:.1f} px: no contact is larger "
        "than the ball; check the ball, the pitch, and what was pressed",
    )


def unexplained(
    pack: PressPack, change: FloatArray, model: FittedModel, ball: float, names: list[str]
) -> dict[int, Refused]:
    """Presses that are not this ball after all, by their place in the pack."""
    worse: dict[int, Refused] = {}
    for k, name in enumerate(names):
        centre, clean = model.fit.centres[k], change[k] - model.rest
        radius = contact_radius(clean, centre, ball)
        large = too_large(name, radius, ball, "its contact")
        gain = _own_gain(pack, clean, centre, model, ball)
        if large is not None:
            worse[k] = large
        elif gain < LEAST_OWN_GAIN:
            worse[k] = Refused(
                name,
                "not explained",
                f"the other presses' colours explain it by {gain:.1f} dB only (at least {LEAST_OWN_GAIN:g}): "
                "another object, a slip, or dirt; press again",
            )
    return worse


def _own_gain(
    pack: PressPack, clean: FloatArray, centre: FloatArray, model: FittedModel, ball: float
) -> float:
    edge = WITHIN * model.fit.edge
    left = residual(pack, clean, centre, model.fit.colours, edge, ball)
    nothing = residual(pack, clean, centre, np.zeros_like(model.fit.colours), edge, ball)
    return decibels(left) - decibels(nothing)


def contact_radius(clean: FloatArray, centre: FloatArray, ball: float) -> float:
    """Pixels from the centre at which one press changes the colour most."""
    rings = strength_by_radius(clean, centre, ball)
    smooth = np.convolve(rings, (0.25, 0.5, 0.25), mode="valid")
    return float(np.argmax(smooth)) + 1.5
