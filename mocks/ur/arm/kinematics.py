"""Joint angles to flange pose and back, in closed form, for the UR3e, UR5e and UR10e.

Lengths: Universal Robots, "DH parameters for calculations of kinematics and dynamics". Joints 2,
3 and 4 are parallel, so the arm is a planar chain in the frame of joint 1, turned by joint 1 and
carrying a wrist: every expression below is written in that frame, as (u, v, w).
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from harness.basics.errors import WrongUse
from mocks.ur.hooks import Matrix, Six

TURN: Final = 2.0 * math.pi
JOINT_LIMITS: Final = (TURN, TURN, math.pi, TURN, TURN, TURN)
"""rad, either way; the elbow meets the upper arm before half a turn."""

_ROUND_OFF: Final = 1e-10
_WRIST_SINGULAR: Final = 1e-10


@dataclass(frozen=True)
class ArmModel:
    """One arm: ``d`` and ``a`` in m, ``payload`` in kg, ``speeds`` in rad/s, name on the dashboard."""

    name: str
    d1: float
    a2: float
    a3: float
    d4: float
    d5: float
    d6: float
    payload: float
    speeds: Six


_MODELS: Final = {
    "ur3e": ArmModel(
        "UR3", 0.15185, -0.24355, -0.2132, 0.13105, 0.08535, 0.0921, 3.0, (math.pi,) * 3 + (TURN,) * 3
    ),
    "ur5e": ArmModel("UR5", 0.1625, -0.425, -0.3922, 0.1333, 0.0997, 0.0996, 5.0, (math.pi,) * 6),
    "ur10e": ArmModel(
        "UR10",
        0.1807,
        -0.6127,
        -0.57155,
        0.17415,
        0.11985,
        0.11655,
        12.5,
        (TURN / 3,) * 2 + (math.pi,) * 4,
    ),
}


def arm_model(name: str) -> ArmModel:
    """The numbers of an arm; ``WrongUse`` for one that is not known."""
    if name not in _MODELS:
        raise WrongUse(f"arm model '{name}' is not known; known: {', '.join(sorted(_MODELS))}")
    return _MODELS[name]


def forward(arm: ArmModel, joints: Sequence[float]) -> Matrix:
    """``base_from_flange``."""
    q1, q2, q3, q4, q5, q6 = joints
    s1, c1, s5, c5, s6, c6 = (f(q) for q in (q1, q5, q6) for f in (math.sin, math.cos))
    s, c = math.sin(q2 + q3 + q4), math.cos(q2 + q3 + q4)
    u = arm.a2 * math.cos(q2) + arm.a3 * math.cos(q2 + q3) + s * arm.d5 - c * s5 * arm.d6
    v = arm.a2 * math.sin(q2) + arm.a3 * math.sin(q2 + q3) - c * arm.d5 - s * s5 * arm.d6
    w = arm.d4 + c5 * arm.d6
    xu, xv, xw = c * c5 * c6 - s * s6, s * c5 * c6 + c * s6, s5 * c6
    yu, yv, yw = -c * c5 * s6 - s * c6, -s * c5 * s6 + c * c6, -s5 * s6
    zu, zv, zw = -c * s5, -s * s5, c5
    return (
        (c1 * xu + s1 * xw, c1 * yu + s1 * yw, c1 * zu + s1 * zw, c1 * u + s1 * w),
        (s1 * xu - c1 * xw, s1 * yu - c1 * yw, s1 * zu - c1 * zw, s1 * u - c1 * w),
        (xv, yv, zv, v + arm.d1),
        (0.0, 0.0, 0.0, 1.0),
    )


def postures(arm: ArmModel, base_from_flange: Matrix, near: Sequence[float]) -> list[Six]:
    """Every posture that reaches and keeps the joints' limits, nearest to ``near`` first."""
    found: list[Six] = []
    for q1 in _shoulders(arm, base_from_flange):
        for q5, q6 in _wrists(q1, base_from_flange, near[5]):
            found.extend(_elbows(arm, base_from_flange, q1, q5, q6))
    turned = [_unwound(posture, near) for posture in found]
    allowed = [posture for posture in turned if within_limits(posture)]
    return sorted(allowed, key=lambda posture: _distance(posture, near))


def follow(arm: ArmModel, base_from_flange: Matrix, near: Sequence[float]) -> Six | None:
    """The posture on the branch that ``near`` is on, one short step away; None where it does not reach."""
    shoulders = list(_shoulders(arm, base_from_flange))
    if not shoulders:
        return None
    q1 = min(shoulders, key=lambda angle: abs(_nearest_turn(angle, near[0]) - near[0]))
    q5, q6 = min(
        _wrists(q1, base_from_flange, near[5]), key=lambda w: abs(math.remainder(w[0] - near[4], TURN))
    )
    folds = [_unwound(posture, near) for posture in _elbows(arm, base_from_flange, q1, q5, q6)]
    return min(folds, key=lambda posture: _distance(posture, near), default=None)


def within_limits(joints: Sequence[float]) -> bool:
    """Whether every joint may stand there."""
    return all(abs(q) <= limit + 1e-9 for q, limit in zip(joints, JOINT_LIMITS, strict=True))


def _distance(a: Sequence[float], b: Sequence[float]) -> float:
    return max(abs(x - y) for x, y in zip(a, b, strict=True))


def _nearest_turn(angle: float, near: float) -> float:
    return near + math.remainder(angle - near, TURN)


def _unwound(posture: Six, near: Sequence[float]) -> Six:
    angles = []
    for angle, other, limit in zip(posture, near, JOINT_LIMITS, strict=True):
        turned = _nearest_turn(angle, other)
        angles.append(turned if abs(turned) <= limit else math.remainder(angle, TURN))
    return angles[0], angles[1], angles[2], angles[3], angles[4], angles[5]


def _shoulders(arm: ArmModel, pose: Matrix) -> Iterator[float]:
    """q1 for which the wrist lies d4 beside the plane of the arm."""
    x = pose[0][3] - arm.d6 * pose[0][2]
    y = pose[1][3] - arm.d6 * pose[1][2]
    radius = math.hypot(x, y)
    if not radius * (1 + _ROUND_OFF) >= arm.d4:
        return
    lean = math.asin(min(arm.d4 / radius, 1.0))
    bearing = math.atan2(y, x)
    yield bearing + lean
    yield bearing + math.pi - lean


def _wrists(q1: float, pose: Matrix, near_q6: float) -> Iterator[tuple[float, float]]:
    """q5 and q6, from the flange's axes along the plane's normal w; where q5 is straight, q6 is free."""
    s1, c1 = math.sin(q1), math.cos(q1)
    xw, yw, zw = (s1 * pose[0][i] - c1 * pose[1][i] for i in range(3))
    s5 = math.hypot(xw, yw)
    if s5 < _WRIST_SINGULAR:
        yield math.atan2(s5, zw), near_q6
        return
    yield math.atan2(s5, zw), math.atan2(-yw, xw)
    yield math.atan2(-s5, zw), math.atan2(yw, -xw)


def _elbows(arm: ArmModel, pose: Matrix, q1: float, q5: float, q6: float) -> Iterator[Six]:
    """Both folds of the upper arm and forearm that reach the wrist."""
    s1, c1, s6, c6 = math.sin(q1), math.cos(q1), math.sin(q6), math.cos(q6)
    beside = [s6 * row[0] + c6 * row[1] for row in pose[:3]]  # y of frame 5: (-sin, cos, 0) of q2 + q3 + q4
    s, c = -(c1 * beside[0] + s1 * beside[1]), beside[2]
    x, y, z = (row[3] - arm.d6 * row[2] for row in pose[:3])
    u = c1 * x + s1 * y - arm.d5 * s
    v = z - arm.d1 + arm.d5 * c
    cosine = (u * u + v * v - arm.a2**2 - arm.a3**2) / (2 * arm.a2 * arm.a3)
    if not abs(cosine) <= 1 + _ROUND_OFF:
        return
    fold = math.acos(max(-1.0, min(1.0, cosine)))
    for q3 in (fold, -fold):
        q2 = math.atan2(v, u) - math.atan2(arm.a3 * math.sin(q3), arm.a2 + arm.a3 * math.cos(q3))
        yield q1, q2, q3, math.atan2(s, c) - q2 - q3, q5, q6
