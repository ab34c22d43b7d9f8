"""Where the flange of a UR arm is, and which joint angles put it there.

Frames follow the Denavit-Hartenberg convention of the maker's tables: frame ``i`` is frame
``i - 1`` turned by joint ``i`` about its z, moved by d_i along it, then moved by a_i along the
new x and turned by the twist alpha_i about it. At zero the arm reaches along -x of its base.

Lengths, masses and centres of mass: Universal Robots, "DH parameters for calculations of
kinematics and dynamics". Inertia tensors and joint limits: Universal_Robots_ROS2_Description
(UR3e and UR5e: values measured by the maker, 2025; UR10e: from CAD). The twist angles are
(pi/2, 0, 0, pi/2, -pi/2, 0) on all of them.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from harness.basics.arrays import FloatArray, read_only
from harness.basics.errors import WrongUse

TWIST_SINES: Final = (1.0, 0.0, 0.0, 1.0, -1.0, 0.0)
"""Sines of the twist angles alpha_i; exact, where sin(pi/2) in floating point is not."""

TWIST_COSINES: Final = (0.0, 1.0, 1.0, 0.0, 0.0, 1.0)

LINKS: Final = ("base", "shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3")
"""Names of the bodies; link ``i`` moves with joint ``i``, counted from 1."""


@dataclass(frozen=True, eq=False)
class ArmTable:
    """One arm model."""

    d: tuple[float, float, float, float, float, float]  #: m, the offset along each joint's axis.
    a: tuple[float, float, float, float, float, float]  #: m, the length from each joint's axis to the next.
    masses: FloatArray  #: ``(6,)`` kg of the moving links.
    centres: FloatArray  #: ``(6, 3)`` m, centre of mass of each link in its Denavit-Hartenberg frame.
    inertias: FloatArray  #: ``(6, 3, 3)`` kg m^2 about the centre of mass, along the Denavit-Hartenberg axes.
    joint_range: FloatArray  #: ``(2, 6)`` rad, least and greatest; the elbow cannot do a whole turn.
    joint_speeds: FloatArray  #: ``(6,)`` rad/s.
    joint_torques: FloatArray  #: ``(6,)`` N m.


def arm_table(model: str) -> ArmTable:
    """The numbers of an arm model.

    Raises:
        WrongUse: the model is not one of those here.
    """
    if model not in ARM_TABLES:
        raise WrongUse(f"arm model '{model}' is not known; known: {', '.join(sorted(ARM_TABLES))}")
    return ARM_TABLES[model]


def _table(
    d: tuple[float, float, float, float],
    a: tuple[float, float],
    masses: list[float],
    centres: list[tuple[float, float, float]],
    inertias: list[tuple[float, float, float, float, float, float]],
    speeds_deg: list[float],
    torques: list[float],
) -> ArmTable:
    """A table of the numbers that are not the same on every arm: d1, d4, d5, d6 and a2, a3."""
    d1, d4, d5, d6 = d
    tensors = [[[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]] for xx, xy, xz, yy, yz, zz in inertias]
    turns = 2 * np.pi * np.array([1.0, 1.0, 0.5, 1.0, 1.0, 1.0])
    return ArmTable(
        d=(d1, 0.0, 0.0, d4, d5, d6),
        a=(0.0, a[0], a[1], 0.0, 0.0, 0.0),
        masses=read_only(np.array(masses)),
        centres=read_only(np.array(centres)),
        inertias=read_only(np.array(tensors)),
        joint_range=read_only(np.stack([-turns, turns])),
        joint_speeds=read_only(np.deg2rad(speeds_deg)),
        joint_torques=read_only(np.array(torques)),
    )


ARM_TABLES: Final[dict[str, ArmTable]] = {
    "ur3e": _table(
        (0.15185, 0.13105, 0.08535, 0.0921),
        (-0.24355, -0.2132),
        [1.98, 3.4445, 1.437, 0.871, 0.805, 0.261],
        [(0, -0.02, 0), (0.13, 0, 0.1157), (0.05, 0, 0.0238), (0, 0, 0.01), (0, 0, 0.01), (0, 0, -0.02)],
        [
            (0.0027657, 0.0000096, -0.0000149, 0.0021501, 0.0001873, 0.0025626),
            (0.0042623, -0.0000409, -0.0014960, 0.0460284, -0.0000129, 0.0448947),
            (0.0010511, 0.0, -0.0000331, 0.0113396, 0.0000022, 0.0110895),
            (0.0008174, -0.0000005, 0.0000021, 0.0006844, 0.0000617, 0.0005497),
            (0.0006059, -0.0000006, -0.0000006, 0.0005837, -0.0000271, 0.0003831),
            (0.0001080, -0.0000001, -0.0000001, 0.0001086, -0.0000002, 0.0001371),
        ],
        [180, 180, 180, 360, 360, 360],
        [54, 54, 28, 9, 9, 9],
    ),
    "ur5e": _table(
        (0.1625, 0.1333, 0.0997, 0.0996),
        (-0.425, -0.3922),
        [3.761, 8.058, 2.846, 1.37, 1.3, 0.365],
        [
            (0, -0.02561, 0.00193),
            (0.2125, 0, 0.11336),
            (0.15, 0, 0.0265),
            (0, -0.0018, 0.01634),
            (0, 0.0018, 0.01634),
            (0, 0, -0.001159),
        ],
        [
            (0.00700210, 0.00000073, -0.00001053, 0.00648091, 0.00049994, 0.00657286),
            (0.01505885, -0.00005400, 0.00000563, 0.33388086, -0.00000181, 0.33247207),
            (0.00399632, -0.00001365, 0.00137272, 0.07879254, -0.00000660, 0.07848510),
            (0.00165491, -0.00000282, -0.00000438, 0.00135962, 0.00010157, 0.00126279),
            (0.00135617, -0.00000274, 0.00000444, 0.00127827, -0.00005048, 0.00096614),
            (0.00018694, 0.00000006, -0.00000017, 0.00018908, -0.00000092, 0.00025756),
        ],
        [180, 180, 180, 180, 180, 180],
        [150, 150, 150, 28, 28, 28],
    ),
    "ur10e": _table(
        (0.1807, 0.17415, 0.11985, 0.11655),
        (-0.6127, -0.57155),
        [7.369, 13.051, 3.989, 2.1, 1.98, 0.615],
        [
            (0.021, 0, 0.027),
            (0.38, 0, 0.158),
            (0.24, 0, 0.068),
            (0, 0.007, 0.018),
            (0, 0.007, 0.018),
            (0, 0, -0.026),
        ],
        [
            (0.03408, 0.00002, -0.00425, 0.03529, 0.00008, 0.02156),
            (0.02814, 0.00005, -0.01561, 0.77068, 0.00002, 0.76943),
            (0.01014, 0.00008, 0.00916, 0.30928, 0.0, 0.30646),
            (0.00296, -0.00001, 0.0, 0.00222, -0.00024, 0.00258),
            (0.00296, -0.00001, 0.0, 0.00222, -0.00024, 0.00258),
            (0.00040, 0.0, 0.0, 0.00041, 0.0, 0.00034),
        ],
        [120, 120, 180, 180, 180, 180],
        [330, 330, 150, 54, 54, 54],
    ),
}


LENGTH: Final = 0.5
"""m that count as much as one radian in :func:`singularity`."""

ROUND_OFF: Final = 1e-12
"""How far past its bound a sine or a cosine may come by rounding alone."""

STRETCH: Final = 1e-9
"""The same for the elbow's cosine, which inherits what a nearly singular wrist leaves undetermined."""

Six = tuple[float, float, float, float, float, float]
Three = tuple[float, float, float]


def link_frames(model: str, joints: FloatArray) -> FloatArray:
    """``base_from_link`` of the base and of the six Denavit-Hartenberg frames.

    Args:
        model: ``"ur3e"``, ``"ur5e"`` or ``"ur10e"``.
        joints: ``(..., 6)`` rad.

    Returns:
        ``(..., 7, 4, 4)``; the first is the base itself, the last the flange.
    """
    table = arm_table(model)
    joints = np.asarray(joints, dtype=np.float64)
    frames = np.zeros((*joints.shape[:-1], 7, 4, 4))
    frames[..., 0, :, :] = np.eye(4)
    cos, sin = np.cos(joints), np.sin(joints)
    twist_sin, twist_cos = np.array(TWIST_SINES), np.array(TWIST_COSINES)
    a = np.array(table.a)
    steps = np.zeros((*joints.shape, 4, 4))
    steps[..., 0, 0], steps[..., 0, 1], steps[..., 0, 2] = cos, -sin * twist_cos, sin * twist_sin
    steps[..., 1, 0], steps[..., 1, 1], steps[..., 1, 2] = sin, cos * twist_cos, -cos * twist_sin
    steps[..., 2, 1], steps[..., 2, 2] = twist_sin, twist_cos
    steps[..., 0, 3], steps[..., 1, 3], steps[..., 2, 3] = a * cos, a * sin, np.array(table.d)
    steps[..., 3, 3] = 1.0
    for i in range(6):
        frames[..., i + 1, :, :] = frames[..., i, :, :] @ steps[..., i, :, :]
    return frames


def forward(model: str, joints: FloatArray) -> FloatArray:
    """``base_from_flange``, ``(..., 4, 4)``, of ``(..., 6)`` rad."""
    flange: FloatArray = link_frames(model, joints)[..., 6, :, :]
    return flange


def jacobian(model: str, joints: FloatArray) -> FloatArray:
    """``(..., 6, 6)``: flange velocity (m, then rad, in base) per joint velocity (rad)."""
    frames = link_frames(model, joints)
    axes = frames[..., :6, :3, 2]
    arms = frames[..., 6:, :3, 3] - frames[..., :6, :3, 3]
    rows = np.concatenate([np.cross(axes, arms), axes], axis=-1)
    return np.swapaxes(rows, -1, -2)


def singularity(model: str, joints: FloatArray) -> FloatArray:
    """Smallest singular value of the Jacobian, lengths over 0.5 m: 0 where a direction is lost.

    About 0.37 in a good posture; below 0.04 a tool at 50 mm/s asks more than 1.2 rad/s of a
    joint. Shape ``(...)`` of ``(..., 6)`` rad.
    """
    scaled = jacobian(model, joints)
    scaled[..., :3, :] /= LENGTH
    smallest = np.linalg.svd(scaled, compute_uv=False)[..., -1]
    return np.asarray(smallest, dtype=np.float64)


def inverse(model: str, base_from_flange: FloatArray, wrist_3: float = 0.0) -> FloatArray:
    """Every posture that puts the flange there, in closed form.

    Args:
        model: as :func:`link_frames` knows it.
        base_from_flange: ``(4, 4)``, rigid.
        wrist_3: rad, the last joint where the wrist is singular and it is free to choose.

    Returns:
        ``(k, 6)`` rad in (-pi, pi], k from 0 (out of reach) to 8: shoulder, wrist and elbow each
        two ways; postures that coincide are given once.
    """
    table = arm_table(model)
    (xx, yx, zx, px), (xy, yy, zy, py), (xz, yz, zz, pz) = base_from_flange[:3].tolist()
    x, y, z = (xx, xy, xz), (yx, yy, yz), (zx, zy, zz)
    postures: list[Six] = []
    for q1 in _shoulders(table.d[3], px - table.d[5] * zx, py - table.d[5] * zy):
        for q5, q6 in _wrists(q1, x, y, z, wrist_3):
            postures.extend(_elbows(table, q1, q5, q6, x, y, z, (px, py, pz)))
    return np.array(postures).reshape(-1, 6)


def nearest_branch(
    model: str, base_from_flange: FloatArray, seed_joints: FloatArray, joint_range: FloatArray
) -> FloatArray | None:
    """The posture that reaches the pose with the least turn of any joint from the seed.

    Args:
        model: as :func:`link_frames` knows it.
        base_from_flange: ``(4, 4)``, rigid.
        seed_joints: ``(6,)`` rad, where the arm is.
        joint_range: ``(2, 6)`` rad, least and greatest; whole turns are added to stay within.

    Returns:
        ``(6,)`` rad, or None where nothing within the range reaches.
    """
    postures = inverse(model, base_from_flange, wrist_3=float(seed_joints[5]))
    turned = within_range(postures, seed_joints, joint_range)
    if len(turned) == 0:
        return None
    nearest: FloatArray = turned[int(np.argmin(np.abs(turned - seed_joints).max(axis=1)))]
    return nearest


def within_range(joints: FloatArray, seed_joints: FloatArray, joint_range: FloatArray) -> FloatArray:
    """Of ``(n, 6)`` rad, those that whole turns bring into the range, each as near the seed as it allows."""
    turn = 2 * math.pi
    low, high = joint_range
    least, most = np.ceil((low - joints) / turn), np.floor((high - joints) / turn)
    wanted = np.round((seed_joints - joints) / turn)
    turned: FloatArray = joints + turn * np.clip(wanted, least, most)
    possible: FloatArray = turned[np.all(least <= most, axis=1)]
    return possible


def _shoulders(d4: float, x: float, y: float) -> list[float]:
    """q1 for which the wrist centre at (x, y) lies d4 beside the plane of the arm."""
    radius = math.hypot(x, y)
    if d4 > radius * (1 + ROUND_OFF):
        return []
    lean = math.asin(min(d4 / radius, 1.0))
    bearing = math.atan2(y, x)
    turns = [bearing + lean, bearing + math.pi - lean]
    return turns[:1] if lean == math.pi / 2 else turns


def _wrists(q1: float, x: Three, y: Three, z: Three, wrist_3: float) -> list[tuple[float, float]]:
    """q5 and q6, from the flange's axes as seen along the normal of the arm's plane."""
    s1, c1 = math.sin(q1), math.cos(q1)
    along_x, along_y, along_z = (s1 * axis[0] - c1 * axis[1] for axis in (x, y, z))
    s5 = math.hypot(along_x, along_y)
    if s5 < ROUND_OFF:
        return [(math.atan2(s5, along_z), wrist_3)]
    return [
        (math.atan2(s5, along_z), math.atan2(-along_y, along_x)),
        (math.atan2(-s5, along_z), math.atan2(along_y, -along_x)),
    ]


def _elbows(
    table: ArmTable, q1: float, q5: float, q6: float, x: Three, y: Three, z: Three, position: Three
) -> list[Six]:
    """Both ways to fold a planar two-link arm to the wrist, with the wrist's own angle."""
    s1, c1, s6, c6 = math.sin(q1), math.cos(q1), math.sin(q6), math.cos(q6)
    axis = [-(s6 * x[i] + c6 * y[i]) for i in range(3)]  # of joint 5
    total = math.atan2(c1 * axis[0] + s1 * axis[1], -axis[2])  # q2 + q3 + q4
    wrist = [position[i] - table.d[5] * z[i] - table.d[4] * axis[i] for i in range(3)]
    u, v = c1 * wrist[0] + s1 * wrist[1], wrist[2] - table.d[0]
    a2, a3 = table.a[1], table.a[2]
    cosine = (u * u + v * v - a2 * a2 - a3 * a3) / (2 * a2 * a3)
    if abs(cosine) > 1 + STRETCH:
        return []
    fold = math.acos(max(-1.0, min(1.0, cosine)))
    postures: list[Six] = []
    for q3 in (fold, -fold) if 0 < fold < math.pi else (fold,):
        q2 = math.atan2(v, u) - math.atan2(a3 * math.sin(q3), a2 + a3 * math.cos(q3))
        postures.append((_wrap(q1), _wrap(q2), _wrap(q3), _wrap(total - q2 - q3), _wrap(q5), _wrap(q6)))
    return postures


def _wrap(angle: float) -> float:
    wrapped = math.remainder(angle, 2 * math.pi)
    return math.pi if wrapped <= -math.pi else wrapped
