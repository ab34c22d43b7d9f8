"""The table ``[scale]`` of a scene file."""

import math
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from harness.basics.quantities import Angle, Length, Nonnegative, Ordered, Positive, Ratio
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
        camera_position_error: m, one standard deviation per axis, of where the camera is.
        camera_rotation_error: rad, likewise, of how it is turned.
        focal_length_error: relative.
        shape: ``"unknown"`` where the object was never drawn: the scene's mesh is then the mocked world's
            alone, and the size is told by what household things look, sound and feel like.
        material: how well the object's material is known: ``"measured"``, its sqrt(E / density) to 3 %;
            ``"named"``, as well as an object said to be of it; ``"unknown"``, one of all seven.
        until: m: a run ends when half its 90 % interval is no wider, whatever contacts are left; None to
            make them all.
        paper_networks: folder of the paper's own networks (``experiments.paper.train``), whose rows a
            table then has beside ours; for tables alone.
        seed: of where, how deep and how tilted the contacts are; a run may say another.
    """

    table: ClassVar[str] = "scale"
    contacts: int = Field(default=10, ge=0, le=100)
    strikes: int = Field(default=3, ge=0, le=100)
    depth: Annotated[tuple[Annotated[Length, Positive], Length], Ordered] = (0.5e-3, 1.5e-3)
    tilt: Annotated[Angle, Nonnegative] = math.radians(15.0)
    place_error: Annotated[Length, Positive] = 20.0e-3
    support_error: Annotated[Length, Positive] = 1.0e-3
    camera_position_error: Annotated[Length, Positive] = 2.0e-3
    camera_rotation_error: Annotated[Angle, Positive] = math.radians(0.2)
    focal_length_error: Annotated[Ratio, Positive] = 5.0e-3
    shape: Literal["known", "unknown"] = "known"
    material: Literal["measured", "named", "unknown"] = "measured"
    until: Annotated[Length, Positive] | None = None
    paper_networks: str | None = None
