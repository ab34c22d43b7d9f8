"""The path of a motion, sampled: what the joints, the flange and the tool's points will do."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.errors import LimitExceeded
from harness.basics.geometry import rotation_from_vector, transform, vector_from_rotation
from harness.bench import kinematics

STEP_LENGTH: Final = 0.01  # m between samples
STEP_ANGLE: Final = 0.05  # rad between samples
NO_LENGTH: Final = 1e-9  # m; a shorter line only turns
GREATEST_JUMP: Final = 0.6  # rad between neighbouring samples; more is a change of branch

ANY_TURN: Final = np.array([[-4 * math.pi] * 6, [4 * math.pi] * 6])  # the range is checked on the whole path


@dataclass(frozen=True, eq=False)
class Path:
    """Samples of a motion, the first at its start and the last at its target."""

    joints: FloatArray  #: ``(n, 6)`` rad.
    flange_positions: FloatArray  #: ``(n, 3)`` m in base.
    tool_points: FloatArray  #: ``(n, points, 3)`` m in base.
    seconds: FloatArray  #: ``(n - 1,)`` s from each sample to the next at the motion's greatest speed.

    @property
    def greatest_tool_speed(self) -> float:
        """m/s of the fastest tool point."""
        steps = np.linalg.norm(np.diff(self.tool_points, axis=0), axis=-1)
        return float(np.max(steps / self.seconds[:, None], initial=0.0))

    @property
    def greatest_joint_speed(self) -> float:
        """rad/s of the fastest joint."""
        return float(np.max(np.abs(np.diff(self.joints, axis=0)) / self.seconds[:, None], initial=0.0))


def peak_speed(distance: float, speed: float, acceleration: float) -> float:
    """The greatest speed on a way from rest to rest: ``speed``, or less where the way is too short."""
    return min(speed, math.sqrt(distance * acceleration))


def joint_path(
    model: str,
    points_in_flange: FloatArray,
    start: FloatArray,
    end: FloatArray,
    speed: float,
    acceleration: float,
) -> Path:
    """A straight line in joint space, the leading joint at ``speed`` rad/s.

    Args:
        model: as the kinematics names it.
        points_in_flange: ``(points, 3)`` m.
        start: ``(6,)`` rad.
        end: ``(6,)`` rad.
        speed: rad/s, above zero.
        acceleration: rad/s^2, above zero.
    """
    largest = max(float(np.abs(end - start).max()), NO_LENGTH)
    count = 1 + max(1, math.ceil(largest / STEP_ANGLE))
    joints = start + np.linspace(0.0, 1.0, count)[:, None] * (end - start)
    poses = kinematics.forward(model, joints)
    seconds = largest / peak_speed(largest, speed, acceleration) / (count - 1)
    return _path(joints, poses, points_in_flange, np.full(count - 1, seconds))


def line_poses(start: FloatArray, end: FloatArray) -> FloatArray:
    """``(n, 4, 4)`` along a straight line, turning evenly about one axis."""
    turn = vector_from_rotation(start[:3, :3].T @ end[:3, :3])
    length = float(np.linalg.norm(end[:3, 3] - start[:3, 3]))
    count = 1 + max(1, math.ceil(length / STEP_LENGTH), math.ceil(float(np.linalg.norm(turn)) / STEP_ANGLE))
    return np.stack(
        [
            transform(start[:3, :3] @ rotation_from_vector(s * turn), (1 - s) * start[:3, 3] + s * end[:3, 3])
            for s in np.linspace(0.0, 1.0, count)
        ]
    )


def line_path(
    model: str,
    points_in_flange: FloatArray,
    start_joints: FloatArray,
    base_from_start: FloatArray,
    base_from_end: FloatArray,
    speed: float,
    acceleration: float,
) -> Path:
    """A straight line of the flange at ``speed`` m/s, in the branch the arm is in.

    A line with no length turns at ``speed`` rad/s.

    Args:
        model: as the kinematics names it.
        points_in_flange: ``(points, 3)`` m.
        start_joints: ``(6,)`` rad, where the arm is.
        base_from_start: ``(4, 4)``, the flange now.
        base_from_end: ``(4, 4)``, the flange wanted.
        speed: m/s, above zero.
        acceleration: m/s^2, above zero.

    Raises:
        LimitExceeded: a pose on the way is out of reach, or needs another branch.
    """
    poses = line_poses(base_from_start, base_from_end)
    joints = _follow(model, start_joints, poses)
    length = float(np.linalg.norm(base_from_end[:3, 3] - base_from_start[:3, 3]))
    turn = float(np.linalg.norm(vector_from_rotation(base_from_start[:3, :3].T @ base_from_end[:3, :3])))
    distance = max(length if length > NO_LENGTH else turn, NO_LENGTH)
    seconds = distance / peak_speed(distance, speed, acceleration) / (len(poses) - 1)
    return _path(joints, poses, points_in_flange, np.full(len(poses) - 1, seconds))


def _follow(model: str, start_joints: FloatArray, poses: FloatArray) -> FloatArray:
    """``(n, 6)`` rad through the poses, each nearest to the one before."""
    joints = [start_joints]
    for index, wanted in enumerate(poses[1:], start=1):
        nearest = kinematics.nearest_branch(model, wanted, joints[-1], ANY_TURN)
        x, y, z = 1e3 * wanted[:3, 3]
        where = f"{index} of {len(poses) - 1} steps along the line, at ({x:.1f}, {y:.1f}, {z:.1f}) mm in base"
        if nearest is None:
            raise LimitExceeded(
                f"straight line of the flange: out of the {model}'s reach {where}: bring the target closer"
            )
        jump = float(np.abs(nearest - joints[-1]).max())
        if jump > GREATEST_JUMP:
            raise LimitExceeded(
                f"straight line of the flange: a joint would jump by {jump:.2f} rad (limit {GREATEST_JUMP} "
                f"rad a step) {where}: the line leaves the present branch; go there by a joint motion first"
            )
        joints.append(nearest)
    return np.stack(joints)


def _path(joints: FloatArray, poses: FloatArray, points: FloatArray, seconds: FloatArray) -> Path:
    tool_points = np.einsum("nij,pj->npi", poses[:, :3, :3], points) + poses[:, None, :3, 3]
    return Path(joints, poses[:, :3, 3], tool_points, seconds)
