"""How far off the bench would have to be for a shape to fit: what is no household shape may fit no other way.

A search may lift a shape off its support, lean it or move the gel and the camera, each by what it costs. That
is what calibrations err by; a body of no class takes more of it than any calibration leaves.
"""

from dataclasses import dataclass

import numpy as np

from experiments.shape_reconstruction.family import layout
from harness.basics.arrays import FloatArray

STRAINED = 20.0
"""Half the sum of squares of some twelve numbers, in standard deviations, above which a shape does not fit.
Right answers by presses and a picture have up to 17, wrong ones of hammers, scissors and bananas 21 to 88."""

_SAYS = {
    layout.X: ("its place", "mm", 1e3),
    layout.Y: ("its place", "mm", 1e3),
    layout.LIFT: ("its support's height", "mm", 1e3),
    layout.TILT_X: ("its upright", "deg", np.degrees(1.0)),
    layout.TILT_Y: ("its upright", "deg", np.degrees(1.0)),
    layout.CAMERA_RIGHT: ("the camera's place", "mm", 1e3),
    layout.CAMERA_DOWN: ("the camera's place", "mm", 1e3),
    layout.CAMERA_SCALE: ("the picture's scale", "%", 1e2),
    layout.OUTLINE: ("the mask's border", "mm", 1e3),
    layout.GEL: ("the gel's place", "mm", 1e3),
    layout.GEL + 1: ("the gel's place", "mm", 1e3),
    layout.GEL + 2: ("the gel's place", "mm", 1e3),
}
"""What each number is, in which unit, and what it is multiplied by for that."""


@dataclass(frozen=True)
class Strain:
    """What a shape asks of the bench.

    Attributes:
        cost: half the sum of squares, in standard deviations.
        most: what is off by the most of them, in words.
    """

    cost: float
    most: str

    @property
    def beyond_belief(self) -> bool:
        """Whether no calibrated bench is off by so much."""
        return self.cost > STRAINED


def strain_of(theta: FloatArray, rows: FloatArray, middle: FloatArray) -> Strain:
    """Of a shape's vector.

    Args:
        theta: ``(SIZE,)``.
        rows: ``(n, SIZE)``, each of one of the bench's numbers over its standard deviation.
        middle: ``(SIZE,)`` that they are expected to be.
    """
    off = rows @ (theta - middle)
    most = int(np.argmax(np.abs(off)))
    slot = int(np.flatnonzero(rows[most])[0])
    name, unit, factor = _SAYS[slot]
    by = factor * abs(theta[slot] - middle[slot])
    said = f"{name} off by {by:.1f} {unit}, {abs(off[most]):.0f} standard deviations"
    return Strain(0.5 * float(off @ off), said)
