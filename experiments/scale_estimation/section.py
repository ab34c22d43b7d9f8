"""The table ``[scale]`` of a scene file."""

import math
from typing import Annotated, ClassVar

from pydantic import Field

from harness.basics.quantities import Angle, Length, Nonnegative, Ordered, Positive
from harness.bench.scene import Section


class Scale(Section):
    """The readings of a scale estimation.

    Attributes:
        contacts: how many.
        strikes: how many of the first contacts are struck too, where the scene is heard.
        depth: m, from and to: how far to press on after the first touch, uniform.
        tilt: rad, the greatest angle of the tool from the surface's normal.
        place_error: m, one standard deviation, per axis, of where on its support the object was put.
        support_error: m, one standard deviation of the height on which the object stands.
        seed: of where, how deep and how tilted the contacts are; a run may say another.
    """

    table: ClassVar[str] = "scale"
    contacts: int = Field(default=10, ge=0, le=100)
    strikes: int = Field(default=3, ge=0, le=100)
    depth: Annotated[tuple[Annotated[Length, Positive], Length], Ordered] = (0.5e-3, 1.5e-3)
    tilt: Annotated[Angle, Nonnegative] = math.radians(15.0)
    place_error: Annotated[Length, Positive] = 20.0e-3
    support_error: Annotated[Length, Positive] = 1.0e-3
