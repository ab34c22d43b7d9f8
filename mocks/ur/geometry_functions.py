"""URScript's functions of numbers and poses that ur_rtde's program calls (Script manual, "urmath")."""

import math
from collections.abc import Callable
from typing import Any, Final

from mocks.ur.arm import poses
from mocks.ur.hooks import Matrix
from mocks.ur.urscript.values import PoseValue, number, six


def matrix(value: Any, what: str) -> Matrix:
    """The transform of a pose."""
    return poses.matrix_from_pose(six(value, what))


def pose(value: Matrix) -> PoseValue:
    """The pose of a transform."""
    return PoseValue(poses.pose_from_matrix(value))


def pose_trans(p_from: Any, p_from_to: Any) -> PoseValue:
    """``p_from`` carried on by ``p_from_to``, given in its frame."""
    return pose(poses.compose(matrix(p_from, "pose_trans"), matrix(p_from_to, "pose_trans")))


def pose_sub(p_to: Any, p_from: Any) -> PoseValue:
    """Positions subtracted, and the turn from ``p_from`` to ``p_to`` in base."""
    to, start = matrix(p_to, "pose_sub"), matrix(p_from, "pose_sub")
    x, y, z = (a - b for a, b in zip(poses.translation(to), poses.translation(start), strict=True))
    return pose(poses.moved_to(poses.compose(to, poses.inverse(start)), (x, y, z)))


def norm(a: Any) -> float:
    """Length of a vector, or absolute value of a number."""
    if isinstance(a, list):
        return math.hypot(*(number(part) for part in a))
    return abs(float(number(a)))


FUNCTIONS: Final[dict[str, Callable[..., Any]]] = {
    "pose_trans": pose_trans,
    "pose_sub": pose_sub,
    "norm": norm,
}
