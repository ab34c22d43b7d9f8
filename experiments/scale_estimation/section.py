"""The table ``[scale]`` of a scene file."""

import math
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from harness.basics.quantities import Angle, Length, Nonnegative, Ordered, Positive, Ratio
from harness.bench.scene import Section


class Scale(Section):
    """The readings of a scale estimation."""

    table: ClassVar[str] = "scale"
    contacts: int = Field(default=10, ge=0, le=100)  #: how many.
    strikes: int = Field(default=3, ge=0, le=100)
    """how many of the first contacts are struck too, where the scene is heard."""
    depth: Annotated[tuple[Annotated[Length, Positive], Length], Ordered] = (0.5e-3, 1.5e-3)
    """m, from and to: how far to press on after the first touch, uniform."""
    tilt: Annotated[Angle, Nonnegative] = math.radians(15.0)
    """rad, the greatest angle of the tool from the surface's normal."""
    place_error: Annotated[Length, Positive] = 20.0e-3
    """m, one standard deviation, per axis, of where on its support the object was put."""
    support_error: Annotated[Length, Positive] = 1.0e-3
    """m, one standard deviation of the height on which the object stands."""
    camera_position_error: Annotated[Length, Positive] = 2.0e-3
    """m, one standard deviation per axis, of where the camera is."""
    camera_rotation_error: Annotated[Angle, Positive] = math.radians(0.2)
    """rad, likewise, of how it is turned."""
    focal_length_error: Annotated[Ratio, Positive] = 5.0e-3  #: relative.
    shape: Literal["known", "unknown"] = "known"
    """``"unknown"`` where the object was never drawn: the scene's mesh is then the mocked world's alone, and
    the size is told by what household things look, sound and feel like."""
    material: Literal["measured", "named", "unknown"] = "measured"
    """how well the object's material is known: ``"measured"``, its sqrt(E / density) to 3 %; ``"named"``, as
    well as an object said to be of it; ``"unknown"``, one of all seven."""
    until: Annotated[Length, Positive] | None = None
    """m: a run ends when half its 90 % interval is no wider, whatever contacts are left; None to make them
    all."""
    paper_networks: str | None = None
    """folder of the paper's own networks (``experiments.paper.train``), whose rows a table then has beside
    ours; for tables alone."""
