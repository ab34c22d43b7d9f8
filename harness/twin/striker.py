"""The hammer that the flange carries beside the gel, as a body that could hit something."""

from typing import Final

import numpy as np
from scipy.spatial import ConvexHull

from harness.basics.arrays import FloatArray
from harness.basics.geometry import apply
from harness.twin.arm import Part

NAME: Final = "hammer"
SOLENOID_RADIUS: Final = 0.012  # m
TIP_RADIUS: Final = 0.004  # m
TIP_LENGTH: Final = 0.02  # m, from the tip at rest back to the solenoid


def striker(flange_from_hammer: FloatArray) -> Part:
    """The hammer at rest in the flange's frame: a slender body from the flange's middle to the tip.

    Args:
        flange_from_hammer: ``(4, 4)``, origin at the tip, z along the strike.
    """
    angles = np.linspace(0.0, 2 * np.pi, 12, endpoint=False)
    ring = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(12)])
    back = np.array([0.0, 0.0, -TIP_LENGTH])
    front = apply(flange_from_hammer, np.concatenate([TIP_RADIUS * ring, SOLENOID_RADIUS * ring + back]))
    root = SOLENOID_RADIUS * ring + np.array([0.0, 0.0, SOLENOID_RADIUS])
    points = np.concatenate([front, root])
    return Part(NAME, 6, points[ConvexHull(points).vertices])
