"""The way between two steps: as planned from where it was planned, else by another to the same end."""

from typing import Final, Protocol

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.geometry import apply
from harness.bench import kinematics
from harness.bench.station import Bench
from harness.bench.station_file import Station

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


_SAMPLES = 60
_NEARER = 1.0e-3
"""M by which a place may be nearer than it is computed to be."""

_SHARE = 0.9
"""Of the limit: what is sampled here may be slower than what is limited in between."""


def joint_speed(
    station: Station, start: FloatArray, end: FloatArray, most: float, contact: FloatArray | None = None
) -> float:
    """rad/s of the joint that turns most, for a straight motion of the joints.

    Args:
        station: whose limits hold for every point of ``tool_points``.
        start: ``(6,)`` rad.
        end: ``(6,)`` rad.
        most: rad/s, never more than this.
        contact: ``(3,)`` m in base, where the flange was when it last met something; None for nowhere. A
            motion that begins or ends near there keeps the lower limit.
    """
    turn = float(np.abs(end - start).max())
    if turn == 0.0:
        return most
    shares = np.linspace(0.0, 1.0, _SAMPLES)
    points = station.tool_points
    poses = kinematics.forward(station.arm.model, start + shares[:, None] * (end - start))
    places = np.array([apply(pose, points) for pose in poses])
    farthest = float(np.linalg.norm(np.diff(places, axis=0), axis=-1).max()) * (_SAMPLES - 1)
    safety = station.arm.safety
    near = contact is not None and any(
        float(np.linalg.norm(pose[:3, 3] - contact)) < safety.near + _NEARER for pose in poses[[0, -1]]
    )
    limit = _SHARE * (safety.speed_near if near else safety.speed)
    return min(most, limit * turn / farthest) if farthest > 0.0 else most
