"""The table ``[localization]`` of a scene file."""

import math
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from harness.basics.quantities import Angle, Length, Nonnegative, Ordered, Positive
from harness.bench.scene import Section


class Localization(Section):
    """The contacts of a localization run."""

    table: ClassVar[str] = "localization"
    contacts: int = Field(default=6, ge=1, le=100)  #: how many.
    spacing: Literal["close", "spread"] = "close"
    """``"close"``, each within ``step`` of the last; ``"spread"``, over the object."""
    step: Annotated[Length, Positive] = 0.025  #: m, the greatest distance between successive close contacts.
    choose: Literal["planned", "active"] = "planned"
    """where the contacts go. ``"planned"``: anywhere that spacing allows, drawn and rehearsed before the
    first. ``"active"``: after the first, each where it should leave least error, planned and rehearsed once
    those before it are read."""
    until: Annotated[Length, Positive] | None = None
    """m: contacts that are chosen one by one end when 90 % of what is believed lies within so much of the
    answer; None to make them all."""
    depth: Annotated[tuple[Annotated[Length, Positive], Length], Ordered] = (0.5e-3, 2e-3)
    """m, from and to: how far to press on after the first touch, uniform."""
    tilt: Annotated[Angle, Nonnegative] = math.radians(15.0)
    """rad, the greatest angle of the tool from the surface's normal."""
    yaw: Literal["known", "unknown"] = "known"  #: whether the estimator is told the object's yaw.
