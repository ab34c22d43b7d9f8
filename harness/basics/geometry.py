"""Rigid transforms as 4x4 matrices whose names say their frames.

``point_in_base = base_from_gel @ point_in_gel``. Quaternions are (w, x, y, z).
"""

import numpy as np

from harness.basics.arrays import FloatArray

UPRIGHT = {
    "z": np.eye(3),
    "-z": np.diag([1.0, -1.0, -1.0]),
    "y": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
    "-y": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]),
    "x": np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]),
    "-x": np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]),
}
"""``(3, 3)`` rotations that turn a named axis to +z."""


def rotate_upright(points: FloatArray, axis: str) -> FloatArray:
    """Rotate ``(n, 3)`` points about the origin so that ``axis``, a key of ``UPRIGHT``, becomes z."""
    if axis == "z":
        return points
    # Infinite coordinates become NaN, and are refused as these are.
    with np.errstate(invalid="ignore"):
        return np.asarray(points @ UPRIGHT[axis].T)


def transform(rotation: FloatArray, translation: FloatArray) -> FloatArray:
    """The 4x4 transform of a ``(3, 3)`` rotation followed by a ``(3,)`` translation in metres."""
    matrix = np.eye(4)
    matrix[:3, :3] = rotation
    matrix[:3, 3] = translation
    return matrix


def translation(offset: FloatArray) -> FloatArray:
    """The 4x4 transform that only moves by ``offset``, ``(3,)`` in metres."""
    return transform(np.eye(3), offset)


def inverse(b_from_a: FloatArray) -> FloatArray:
    """``a_from_b`` of a rigid ``(..., 4, 4)`` transform, by transposition."""
    rotation_t = np.swapaxes(b_from_a[..., :3, :3], -1, -2)
    a_from_b = np.zeros_like(b_from_a)
    a_from_b[..., :3, :3] = rotation_t
    a_from_b[..., :3, 3] = -np.einsum("...ij,...j->...i", rotation_t, b_from_a[..., :3, 3])
    a_from_b[..., 3, 3] = 1.0
    return a_from_b


def apply(b_from_a: FloatArray, points_in_a: FloatArray) -> FloatArray:
    """``(n, 3)`` points of frame a, in frame b."""
    moved: FloatArray = points_in_a @ b_from_a[:3, :3].T + b_from_a[:3, 3]
    return moved


def rotation_about(axis: FloatArray, angle: float) -> FloatArray:
    """``(3, 3)`` rotation by ``angle`` rad about a unit ``axis`` (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rotation: FloatArray = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return rotation


def quaternion_from_rotation(rotation: FloatArray) -> FloatArray:
    """``(4,)`` unit quaternion (w, x, y, z), w >= 0, of a ``(3, 3)`` rotation.

    Shepperd's choice of the largest component keeps every digit near a half turn,
    where a tool that points down always is.
    """
    trace = np.trace(rotation)
    squares = np.array([trace, *np.diag(rotation)])
    largest = int(np.argmax(squares))
    if largest == 0:
        q = np.array(
            [
                1.0 + trace,
                rotation[2, 1] - rotation[1, 2],
                rotation[0, 2] - rotation[2, 0],
                rotation[1, 0] - rotation[0, 1],
            ]
        )
    else:
        i = largest - 1
        j, k = (i + 1) % 3, (i + 2) % 3
        q = np.empty(4)
        q[0] = rotation[k, j] - rotation[j, k]
        q[1 + i] = 1.0 + 2.0 * rotation[i, i] - trace
        q[1 + j] = rotation[j, i] + rotation[i, j]
        q[1 + k] = rotation[k, i] + rotation[i, k]
    q /= np.linalg.norm(q)
    unit: FloatArray = -q if q[0] < 0 else q
    return unit


def rotation_from_quaternion(quaternion: FloatArray) -> FloatArray:
    """``(3, 3)`` rotation of a quaternion (w, x, y, z) of any length but zero."""
    w, x, y, z = quaternion / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def rotation_from_vector(vector: FloatArray) -> FloatArray:
    """``(3, 3)`` rotation of a ``(3,)`` rotation vector in rad (axis times angle)."""
    angle = float(np.linalg.norm(vector))
    return np.eye(3) if angle == 0.0 else rotation_about(vector / angle, angle)


def vector_from_rotation(rotation: FloatArray) -> FloatArray:
    """``(3,)`` rotation vector in rad, length 0 to pi, exact up to a half turn."""
    w, *xyz = quaternion_from_rotation(rotation)
    sine = float(np.linalg.norm(xyz))
    if sine == 0.0:
        return np.zeros(3)
    vector: FloatArray = np.asarray(xyz) * (2.0 * np.arctan2(sine, w) / sine)
    return vector


def frame_facing(axis: FloatArray, yaw: float) -> FloatArray:
    """``(3, 3)`` rotation whose z column is the unit ``axis``, turned by ``yaw`` rad about it.

    The zero of yaw varies smoothly with the axis everywhere but at the axis -z
    (Duff et al., Building an Orthonormal Basis, Revisited, JCGT 6(1), 2017, before
    its sign change: one pole instead of a seam along the equator).
    """
    x, y, z = axis
    across = x * x + y * y
    if z < 0.0 and across == 0.0:
        base = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]])
    else:
        # The same number; near the pole 1 + z has lost the digits that x and y still have.
        a = 1.0 / (1.0 + z) if z > -0.9 else (1.0 - z) / across
        b = -x * y * a
        base = np.array([[1.0 - x * x * a, b, x], [b, 1.0 - y * y * a, y], [-x, -y, z]])
    rotation: FloatArray = base @ rotation_about(np.array([0.0, 0.0, 1.0]), yaw)
    return rotation
