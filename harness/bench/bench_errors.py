"""How far a bench may be from what its station and its scenes state: what estimators and comparisons assume.

The one home of these numbers. A station states its own as ``[errors]``; what it leaves out is that of a bench
that was set up with care.
"""

from typing import Annotated

import numpy as np

from harness.basics.quantities import Angle, Length, Positive, Ratio
from harness.basics.toml_file import StrictModel


class BenchErrors(StrictModel):
    """One standard deviation of everything that may be off at a bench."""

    yaw: Annotated[Angle, Positive] = float(np.radians(1.5))
    """rad, of the object about the vertical, where a scene states it."""
    tilt: Annotated[Angle, Positive] = float(np.radians(0.5))
    """rad, of the object about base x and about base y."""
    scale: Annotated[Ratio, Positive] = 0.005  #: of the object's true size over its model's, less 1.
    gel_centre: Annotated[Length, Positive] = 0.5e-3
    """m, of the gel's centre along each axis of its own frame."""
    gel_tilt: Annotated[Angle, Positive] = float(np.radians(0.7))  #: rad, of the gel about its x and y each.
    gel_yaw: Annotated[Angle, Positive] = float(np.radians(1.0))  #: rad, of the gel's image about its z.
    arm: Annotated[Length, Positive] = 0.45e-3
    """m, of each contact along each axis: the arm's pose, and the object's shape there."""
    arm_tilt: Annotated[Angle, Positive] = float(np.radians(0.8))  #: rad, of each contact about each axis.
    gel_depth: Annotated[Length, Positive] = 0.064e-3
    """m, root mean square over a contact, of the depth that the gel's picture gives."""

    def times(self, factor: float) -> "BenchErrors":
        """All of them so many times as large; ``factor`` is above 0."""
        return BenchErrors.model_construct(**{name: factor * value for name, value in self})


USUAL = BenchErrors()
"""Of a bench that was set up with care: where a station states no others."""
