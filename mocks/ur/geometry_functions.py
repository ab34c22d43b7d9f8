"""URScript's functions of numbers and poses: they touch nothing (Script manual, "urmath")."""

import math
from collections.abc import Callable
from typing import Any, Final

from mocks.ur.arm import poses
from mocks.ur.hooks import Matrix
from mocks.ur.urscript.errors import ScriptError
from mocks.ur.urscript.values import PoseValue, number, show, six


def matrix(value: Any, what: str) -> Matrix:
    """The transform of a pose."""
    return poses.matrix_from_pose(six(value, what))


def pose(value: Matrix) -> PoseValue:
    """The pose of a transform."""
    return PoseValue(poses.pose_from_matrix(value))


def pose_trans(p_from: Any, p_from_to: Any) -> PoseValue:
    """``p_from`` carried on by ``p_from_to``, given in its frame."""
    return pose(poses.compose(matrix(p_from, "pose_trans"), matrix(p_from_to, "pose_trans")))


def pose_inv(p_from: Any) -> PoseValue:
    """The way back."""
    return pose(poses.inverse(matrix(p_from, "pose_inv")))


def pose_add(p_1: Any, p_2: Any) -> PoseValue:
    """Positions added, rotations one after the other."""
    first, second = matrix(p_1, "pose_add"), matrix(p_2, "pose_add")
    x, y, z = (a + b for a, b in zip(poses.translation(first), poses.translation(second), strict=True))
    return pose(poses.moved_to(poses.compose(first, second), (x, y, z)))


def pose_sub(p_to: Any, p_from: Any) -> PoseValue:
    """Positions subtracted, and the turn from ``p_from`` to ``p_to`` in base."""
    to, start = matrix(p_to, "pose_sub"), matrix(p_from, "pose_sub")
    x, y, z = (a - b for a, b in zip(poses.translation(to), poses.translation(start), strict=True))
    return pose(poses.moved_to(poses.compose(to, poses.inverse(start)), (x, y, z)))


def pose_dist(pose_from: Any, pose_to: Any) -> float:
    """Length of the six numbers' difference of two poses."""
    return math.hypot(*pose_sub(pose_to, pose_from))


def point_dist(p_from: Any, p_to: Any) -> float:
    """Metres between two poses' points."""
    return math.dist(six(p_from, "point_dist")[:3], six(p_to, "point_dist")[:3])


def interpolate_pose(p_from: Any, p_to: Any, alpha: Any) -> PoseValue:
    """The pose at a share of the straight way."""
    start, goal = matrix(p_from, "interpolate_pose"), matrix(p_to, "interpolate_pose")
    turn = poses.rotation_vector(poses.compose(poses.inverse(start), goal))
    return pose(poses.between(start, turn, poses.translation(goal), float(number(alpha))))


def norm(a: Any) -> float:
    """Length of a vector, or absolute value of a number."""
    if isinstance(a, list):
        return math.hypot(*(number(part) for part in a))
    return abs(float(number(a)))


def length(v: Any) -> int:
    """Elements of a list, or letters of a string."""
    if not isinstance(v, list | str):
        raise ScriptError(f"length of {show(v)}")
    return len(v)


def to_str(val: Any) -> str:
    """As text."""
    return show(val)


def _one(function: Callable[[float], float]) -> Callable[[Any], float]:
    return lambda f: function(float(number(f)))


FUNCTIONS: Final[dict[str, Callable[..., Any]]] = {
    "pose_trans": pose_trans,
    "pose_inv": pose_inv,
    "pose_add": pose_add,
    "pose_sub": pose_sub,
    "pose_dist": pose_dist,
    "point_dist": point_dist,
    "interpolate_pose": interpolate_pose,
    "norm": norm,
    "length": length,
    "get_list_length": length,
    "to_str": to_str,
    "sin": _one(math.sin),
    "cos": _one(math.cos),
    "tan": _one(math.tan),
    "asin": _one(math.asin),
    "acos": _one(math.acos),
    "atan": _one(math.atan),
    "sqrt": _one(math.sqrt),
    "d2r": _one(math.radians),
    "r2d": _one(math.degrees),
    "floor": _one(math.floor),
    "ceil": _one(math.ceil),
    "atan2": lambda x, y: math.atan2(number(x), number(y)),
    "pow": lambda base, exponent: math.pow(number(base), number(exponent)),
    "log": lambda b, f: math.log(number(f), number(b)),
}
