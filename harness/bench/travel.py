"""The way between two steps: as planned from where it was planned, else by another to the same end."""

from typing import Final, Protocol

import numpy as np

from harness.basics.arrays import FloatArray
from harness.bench.pace import joint_speed
from harness.bench.station import Bench

WHERE_PLANNED: Final = 1e-3
"""rad: an arm this near to where a travel was planned from is there."""


class Trajectory(Protocol):
    """Finds joint way points that hit nothing."""

    def __call__(self, here: FloatArray, planned: FloatArray) -> FloatArray:
        """``(m, 6)`` rad, from ``(6,)`` to the last of the ``(n, 6)`` postures of a planned travel."""


def travel(
    bench: Bench,
    start: FloatArray,
    planned: FloatArray,
    elsewhere: Trajectory,
    speed: float,
    acceleration: float,
    contact: FloatArray | None = None,
) -> None:
    """Move along planned way points; from elsewhere than planned, by another way to the last of them.

    Args:
        bench: whose arm moves, within its station's speed limit.
        start: ``(6,)`` rad, where the travel was planned from.
        planned: ``(n, 6)`` rad, its way points; none where the arm is to stay.
        elsewhere: finds the other way.
        speed: rad/s of the fastest joint, at most.
        acceleration: rad/s^2.
        contact: ``(3,)`` m in base, where the flange last met something; None for nowhere.
    """
    here = bench.arm.state().joints
    there = np.abs(here - start).max() < WHERE_PLANNED
    for joints in planned if there else elsewhere(here, np.vstack([start, planned])):
        pace = joint_speed(bench.station, here, joints, speed, contact)
        bench.arm.move_joints(joints, pace, acceleration)
        here = joints
