"""Simulated time, and how far along its way a motion is: the trapezoid of speed of UR's planner."""

from dataclasses import dataclass

import numpy as np

from harness.arrays import FloatArray
from harness.geometry import rotation_from_vector


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


@dataclass(frozen=True)
class Profile:
    """A trapezoid of speed over one unit of way.

    Attributes:
        duration: s, of the whole.
        ramp: s, of speeding up and again of slowing down.
    """

    duration: float
    ramp: float

    def at(self, time: float) -> float:
        """Share of the way after ``time`` s, 0 to 1."""
        if self.duration == 0.0 or time >= self.duration:
            return 1.0
        peak = 1.0 / (self.duration - self.ramp)
        if time < self.ramp:
            return 0.5 * peak * time * time / self.ramp
        left = self.duration - time
        if left < self.ramp:
            return 1.0 - 0.5 * peak * left * left / self.ramp
        return peak * (time - 0.5 * self.ramp)


def profile(length: float, speed: float, acceleration: float) -> Profile:
    """Rest to rest over ``length`` at no more than ``speed``."""
    ramp = min(speed / acceleration, float(np.sqrt(length / acceleration)))
    peak = min(speed, acceleration * ramp) if ramp > 0.0 else speed
    return Profile(length / peak + ramp if length > 0.0 else 0.0, ramp)


def between(start: FloatArray, goal: FloatArray, turn: FloatArray, share: float) -> FloatArray:
    """The pose at ``share`` of the way in a straight line, ``turn`` being the whole turn in start's frame."""
    pose = np.eye(4)
    pose[:3, :3] = start[:3, :3] @ rotation_from_vector(share * turn)
    pose[:3, 3] = start[:3, 3] + share * (goal[:3, 3] - start[:3, 3])
    return goal.copy() if share == 1.0 else pose
