"""Signed distance of any shape of the family in the frame ``stand``."""

import numpy as np

from experiments.shape_reconstruction.family.bent import bent_box, bent_distance, prepare_bent
from experiments.shape_reconstruction.family.layout import (
    BOX,
    KIND,
    LIFT,
    POSE_SIZE,
    PREPARED,
    REVOLUTION,
    TILT_X,
    TILT_Y,
    TOOL,
    YAW,
    X,
    Y,
)
from experiments.shape_reconstruction.family.revolution_distance import (
    prepare_revolution,
    revolution_box,
    revolution_distance,
)
from experiments.shape_reconstruction.family.tool import prepare_tool, tool_box, tool_distance
from harness.basics.arrays import FloatArray, IntArray
from harness.basics.compiled import compiled

_LEANT = 5.0e-3
"""Distance by which a leaning body may be outside its upright box, m."""


@compiled
def prepare(code: IntArray, theta: FloatArray, q: FloatArray) -> None:
    """Fill ``(PREPARED,)`` numbers from a shape's vector: pose first, then the kind's metres."""
    q[0], q[1], q[2] = theta[X], theta[Y], theta[LIFT]
    q[3], q[4] = np.cos(theta[YAW]), np.sin(theta[YAW])
    q[5], q[6] = theta[TILT_X], theta[TILT_Y]
    own, box = theta[POSE_SIZE:], q[BOX : BOX + 6]
    if code[KIND] == REVOLUTION:
        prepare_revolution(code, own, q)
        revolution_box(code, q, box)
    elif code[KIND] == TOOL:
        prepare_tool(code, own, q)
        tool_box(code, q, box)
    else:
        prepare_bent(own, q)
        bent_box(q, box)


@compiled
def ball(q: FloatArray, middle: FloatArray) -> float:
    """Fill in the middle, in ``stand``, of a ball that holds the body; returns its radius in m."""
    x, y, z = 0.5 * (q[BOX] + q[BOX + 3]), 0.5 * (q[BOX + 1] + q[BOX + 4]), 0.5 * (q[BOX + 2] + q[BOX + 5])
    middle[0] = q[0] + q[3] * x - q[4] * y
    middle[1] = q[1] + q[4] * x + q[3] * y
    middle[2] = q[2] + z
    a, b, c = q[BOX + 3] - x, q[BOX + 4] - y, q[BOX + 5] - z
    return float(np.sqrt(a * a + b * b + c * c))


@compiled
def inside_depth(code: IntArray, q: FloatArray, x: float, y: float, z: float) -> float:
    """The signed distance where it is negative, else zero: most places are told by the body's box."""
    px, py, pz = x - q[0], y - q[1], z - q[2]
    if pz > q[BOX + 5] + _LEANT or pz < q[BOX + 2] - _LEANT:
        return 0.0
    u, v = q[3] * px + q[4] * py, -q[4] * px + q[3] * py
    if u < q[BOX] - _LEANT or u > q[BOX + 3] + _LEANT or v < q[BOX + 1] - _LEANT or v > q[BOX + 4] + _LEANT:
        return 0.0
    return float(min(distance(code, q, False, x, y, z), 0.0))


@compiled
def distance(code: IntArray, q: FloatArray, filled: bool, x: float, y: float, z: float) -> float:
    """Compute the signed distance from the surface at a point in ``stand``, m.

    ``filled`` closes what no ray of sight gets through, a vessel up to its rim, and what masks are filled at,
    the hole of a handle or of a ring.
    """
    px, py, pz = x - q[0], y - q[1], z - q[2]
    # The body's tilt, to first order, then its yaw.
    tx, ty = q[5], q[6]
    px, py, pz = px - ty * pz, py + tx * pz, pz + ty * px - tx * py
    u, v = q[3] * px + q[4] * py, -q[4] * px + q[3] * py
    if code[KIND] == REVOLUTION:
        return float(revolution_distance(code, q, filled, u, v, pz))
    if code[KIND] == TOOL:
        return float(tool_distance(code, q, filled, u, v, pz))
    return float(bent_distance(q, u, v, pz))


@compiled
def distances(code: IntArray, theta: FloatArray, points: FloatArray) -> FloatArray:
    """``(n,)`` m at ``(n, 3)`` m in ``stand``."""
    q = np.empty(PREPARED)
    prepare(code, theta, q)
    out = np.empty(len(points))
    for n in range(len(points)):
        out[n] = distance(code, q, False, points[n, 0], points[n, 1], points[n, 2])
    return out
