"""The table ``[shape]`` of a scene file."""

import math
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from harness.basics.quantities import Angle, Length, Nonnegative, Ordered, Positive, Ratio
from harness.bench.scene import Section

MOST_PRESSES = 100

Choice = Literal["planned", "random", "farthest", "active"]


class ShapeRun(Section):
    """The readings of a shape reconstruction."""

    table: ClassVar[str] = "shape"
    presses: int = Field(default=16, ge=0, le=MOST_PRESSES)
    """how many guarded ways of the gel; those that meet nothing count."""
    choose: Choice = "active"
    """where they lead. ``"random"``: anywhere into the space that the object may take. ``"farthest"``: far
    from what was touched and passed so far. ``"active"``: where a press should spare most error.
    ``"planned"``: to places drawn on the object's mesh, as a benchmark of touches anywhere; the object is
    then no unknown one to the arm."""
    depth: Annotated[tuple[Annotated[Length, Positive], Length], Ordered] = (0.5e-3, 1.5e-3)
    """m, from and to: how far to press on after the first touch, uniform."""
    tilt: Annotated[Angle, Nonnegative] = math.radians(15.0)
    """rad, the greatest angle of the tool from the surface's normal, of ``"planned"`` ways."""
    largest: Annotated[Length, Positive] = 0.3  #: m: no side of the object is longer.
    place_error: Annotated[Length, Positive] = 20.0e-3
    """m, one standard deviation, per axis, of where on its support the object was put."""
    support_error: Annotated[Length, Positive] = 1.0e-3
    """m, one standard deviation of the height on which the object stands."""
    camera_position_error: Annotated[Length, Positive] = 2.0e-3
    """m, one standard deviation per axis, of where the camera is."""
    camera_rotation_error: Annotated[Angle, Positive] = math.radians(0.2)
    """rad, likewise, of how it is turned."""
    focal_length_error: Annotated[Ratio, Positive] = 5.0e-3  #: relative.
    contact_error: Annotated[Length, Positive] = 0.6e-3
    """m, one standard deviation of a contact's points along their normals: the arm's and the gel's places,
    beside the errors that the gel's picture has."""
    contact_tilt_error: Annotated[Angle, Positive] = math.radians(2.5)
    """rad, one standard deviation of a contact's normals: how the gel is mounted, and what its colours
    say."""
    until: Annotated[Length, Positive] | None = None
    """m: a run ends when the mean deviation that the estimate claims is no greater, whatever presses are
    left; None to make them all."""
    library: str | None = None
    """folder of meshes or ObjectFiles that the row ``retrieval`` of a table chooses among; None for household
    shapes that come with the program. A run does not use it."""
    pcn: str | None = None
    """folder of the paper's own networks (``experiments.paper.train``), whose rows a table shows beside ours;
    a run does not use it."""
