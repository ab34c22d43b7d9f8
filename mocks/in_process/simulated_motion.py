"""Simulated time, and the pose at a share of a straight way."""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.geometry import rotation_from_vector


@dataclass
class Stage:
    """Where a run is in time and in its plan.

    Attributes:
        time: s on the simulated bench clock.
        step: of the run; -1 before the first.
        sample: of the step; -1 before the first.
    """

    time: float = 0.0
    step: int = -1
    sample: int = -1

    def pause(self, seconds: float) -> None:
        """Let simulated time pass."""
        self.time += seconds


def between(start: FloatArray, goal: FloatArray, turn: FloatArray, share: float) -> FloatArray:
    """The pose at ``share`` of the way in a straight line, ``turn`` being the whole turn in start's frame."""
    pose = np.eye(4)
    pose[:3, :3] = start[:3, :3] @ rotation_from_vector(share * turn)
    pose[:3, 3] = start[:3, 3] + share * (goal[:3, 3] - start[:3, 3])
    return goal.copy() if share == 1.0 else pose
