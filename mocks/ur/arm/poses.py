"""Rigid transforms as nested tuples, and the six numbers UR calls a pose.

A pose is x, y, z in metres and a rotation vector in radians. Rotation vectors go through unit
quaternions: the angle from the trace alone loses half its digits near pi, where every pose with
the tool straight down lies.
"""

import math
from collections.abc import Sequence

from mocks.ur.hooks import Matrix, Six

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

IDENTITY: Matrix = ((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))
_BOTTOM = (0.0, 0.0, 0.0, 1.0)


def compose(a: Matrix, b: Matrix) -> Matrix:
    """``a @ b``."""
    b0, b1, b2, _ = b
    rows = [
        (
            x * b0[0] + y * b1[0] + z * b2[0],
            x * b0[1] + y * b1[1] + z * b2[1],
            x * b0[2] + y * b1[2] + z * b2[2],
            x * b0[3] + y * b1[3] + z * b2[3] + t,
        )
        for x, y, z, t in a[:3]
    ]
    return (*rows, _BOTTOM)


def inverse(a: Matrix) -> Matrix:
    """The transform that undoes ``a``."""
    columns = tuple(zip(*(row[:3] for row in a[:3]), strict=True))
    origin = translation(a)
    rows = [(x, y, z, -(x * origin[0] + y * origin[1] + z * origin[2])) for x, y, z in columns]
    return (*rows, _BOTTOM)


def translation(a: Matrix) -> Vector:
    """Where the origin goes, m."""
    return a[0][3], a[1][3], a[2][3]


def moved_to(a: Matrix, position: Vector) -> Matrix:
    """The same rotation with its origin at ``position``."""
    rows = [(row[0], row[1], row[2], position[i]) for i, row in enumerate(a[:3])]
    return (*rows, _BOTTOM)


def rotated(a: Matrix, vector: Vector) -> Vector:
    """A direction of the second frame, in the first."""
    x, y, z = vector
    r0, r1, r2, _ = a
    return (
        r0[0] * x + r0[1] * y + r0[2] * z,
        r1[0] * x + r1[1] * y + r1[2] * z,
        r2[0] * x + r2[1] * y + r2[2] * z,
    )


def rotated_back(a: Matrix, vector: Vector) -> Vector:
    """A direction of the first frame, in the second."""
    x, y, z = vector
    r0, r1, r2, _ = a
    return (
        r0[0] * x + r1[0] * y + r2[0] * z,
        r0[1] * x + r1[1] * y + r2[1] * z,
        r0[2] * x + r1[2] * y + r2[2] * z,
    )


def matrix_from_pose(pose: Sequence[float]) -> Matrix:
    """The transform of x, y, z (m) and a rotation vector (rad)."""
    x, y, z, rx, ry, rz = pose
    angle = math.sqrt(rx * rx + ry * ry + rz * rz)
    half = 0.5 * angle
    share = math.sin(half) / angle if angle > 1e-12 else 0.5
    return matrix_from_quaternion((math.cos(half), rx * share, ry * share, rz * share), (x, y, z))


def pose_from_matrix(a: Matrix) -> Six:
    """x, y, z (m) and the rotation vector (rad) of length at most pi."""
    return (*translation(a), *rotation_vector(a))


def rotation_vector(a: Matrix) -> Vector:
    """Axis times angle, rad, at most pi long."""
    w, x, y, z = quaternion(a)
    sine = math.sqrt(x * x + y * y + z * z)
    scale = 2.0 * math.atan2(sine, w) / sine if sine > 1e-12 else 2.0
    return scale * x, scale * y, scale * z


def quaternion(a: Matrix) -> Quaternion:
    """The unit quaternion (w, x, y, z) with w >= 0 (Shepperd, 1978)."""
    (xx, xy, xz, _), (yx, yy, yz, _), (zx, zy, zz, _), _ = a
    squares = (1 + xx + yy + zz, 1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz)
    largest = squares.index(max(squares))
    q = (
        (squares[0], zy - yz, xz - zx, yx - xy),
        (zy - yz, squares[1], yx + xy, xz + zx),
        (xz - zx, yx + xy, squares[2], zy + yz),
        (yx - xy, xz + zx, zy + yz, squares[3]),
    )[largest]
    scale = math.copysign(1.0, q[0]) / math.sqrt(sum(value * value for value in q))
    return q[0] * scale, q[1] * scale, q[2] * scale, q[3] * scale


def matrix_from_quaternion(q: Quaternion, position: Vector) -> Matrix:
    """The transform of a unit quaternion (w, x, y, z) and an origin in m."""
    w, x, y, z = q
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), position[0]),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x), position[1]),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y), position[2]),
        _BOTTOM,
    )


def between(start: Matrix, turn: Vector, goal: Vector, share: float) -> Matrix:
    """The pose at ``share`` of a straight line to ``goal``; ``turn`` is the whole turn, in start's frame."""
    x, y, z = translation(start)
    step = matrix_from_pose((0.0, 0.0, 0.0, share * turn[0], share * turn[1], share * turn[2]))
    position = (x + share * (goal[0] - x), y + share * (goal[1] - y), z + share * (goal[2] - z))
    return moved_to(compose(start, step), position)


def carried(pose: Matrix, velocity: Sequence[float], seconds: float) -> Matrix:
    """The pose after moving at a velocity (of the tool centre point, in base)."""
    x, y, z, rx, ry, rz = (seconds * part for part in velocity)
    turned = compose(matrix_from_pose((0.0, 0.0, 0.0, rx, ry, rz)), pose)
    px, py, pz = translation(pose)
    return moved_to(turned, (px + x, py + y, pz + z))
