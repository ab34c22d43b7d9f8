"""Signed distance of any shape of the family in the frame ``stand``, and of flat tools and bent bodies."""

import numpy as np

from experiments.shape_reconstruction.family.layout import (
    ARC,
    BEND,
    END_A,
    END_B,
    FLAT,
    GIRTH_KNOTS,
    GIRTHS,
    HEAD_A,
    HEAD_B,
    HEAD_THICK,
    HOLE_A,
    HOLE_B,
    KIND,
    LENGTH,
    LIFT,
    PLAIN,
    RING,
    SHAFT_A,
    SHAFT_B,
    SHAFT_THICK,
    SLOT,
    SLOT_TURN,
    TILT_X,
    TILT_Y,
    TOOL,
    TURNED,
    YAW,
    X,
    Y,
)
from experiments.shape_reconstruction.family.turned import prepare_turned, turned_box, turned_distance
from harness.basics.arrays import FloatArray, IntArray
from harness.basics.compiled import compiled

PREPARED = 64
"""Numbers that a distance is computed from."""

BOX = 54
"""Of them, six: the body's box in its own frame, least x, y, z, then greatest."""

_LEANT = 5.0e-3
"""M by which a body may be out of its upright box, as it leans."""


@compiled
def prepare(code: IntArray, theta: FloatArray, q: FloatArray) -> None:
    """Fill ``(PREPARED,)`` numbers from a shape's ``(SIZE,)`` vector: pose first, then the kind's metres."""
    q[0], q[1], q[2] = theta[X], theta[Y], theta[LIFT]
    q[3], q[4] = np.cos(theta[YAW]), np.sin(theta[YAW])
    q[5], q[6] = theta[TILT_X], theta[TILT_Y]
    box = q[BOX : BOX + 6]
    if code[KIND] == TURNED:
        prepare_turned(code, theta, q)
        turned_box(code, q, box)
    elif code[KIND] == TOOL:
        prepare_tool(code, theta, q)
        tool_box(code, q, box)
    else:
        prepare_bent(theta, q)
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
    """Metres from the surface at a place in ``stand``, negative inside.

    ``filled`` closes what no ray of sight gets through, a vessel up to its rim, and what masks are filled at,
    the hole of a handle or of a ring.
    """
    px, py, pz = x - q[0], y - q[1], z - q[2]
    # The body's tilt, to first order, then its yaw.
    tx, ty = q[5], q[6]
    px, py, pz = px - ty * pz, py + tx * pz, pz + ty * px - tx * py
    u, v = q[3] * px + q[4] * py, -q[4] * px + q[3] * py
    if code[KIND] == TURNED:
        return float(turned_distance(code, q, filled, u, v, pz))
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


_HALF, _WA, _WB, _TS, _TH, _RA, _RB, _HA, _HB, _TURN = 8, 9, 10, 11, 12, 13, 14, 15, 16, 17
_MIDDLE = 18


@compiled
def prepare_tool(code: IntArray, theta: FloatArray, q: FloatArray) -> None:
    """Fill in the metres of a tool from its vector."""
    q[_HALF] = 0.5 * np.exp(theta[LENGTH])
    q[_WA], q[_WB] = np.exp(theta[SHAFT_A]), np.exp(theta[SHAFT_B])
    q[_TS], q[_TH] = np.exp(theta[SHAFT_THICK]), np.exp(theta[HEAD_THICK])
    q[_RA], q[_RB] = np.exp(theta[HEAD_A]), np.exp(theta[HEAD_B])
    q[_HA], q[_HB] = np.exp(theta[HOLE_A]), np.exp(theta[HOLE_B])
    q[_TURN] = theta[SLOT_TURN]
    # It lies on its thickest part, the others are centred on that one's middle plane.
    plain = code[END_A] == PLAIN and code[END_B] == PLAIN
    q[_MIDDLE] = q[_TS] if plain else max(q[_TS], q[_TH])


@compiled
def tool_box(code: IntArray, q: FloatArray, box: FloatArray) -> None:
    """Fill in the tool's box in its own frame: least x, y, z, greatest x, y, z."""
    wide = max(q[_WA], q[_WB])
    box[0], box[3] = -q[_HALF], q[_HALF]
    if code[END_A] != PLAIN:
        wide, box[0] = max(wide, q[_RA]), -q[_HALF] - q[_RA]
    if code[END_B] != PLAIN:
        wide, box[3] = max(wide, q[_RB]), q[_HALF] + q[_RB]
    box[1], box[2], box[4], box[5] = -wide, 0.0, wide, 2.0 * q[_MIDDLE]


@compiled
def tool_distance(code: IntArray, q: FloatArray, filled: bool, x: float, y: float, z: float) -> float:
    """Metres from the tool's surface, negative inside; ``filled`` closes its holes, as masks do."""
    up = abs(z - q[_MIDDLE])
    best = _thick(_shaft(q, x, y), up - q[_TS])
    if code[END_A] != PLAIN:
        flat = np.sqrt((x + q[_HALF]) ** 2 + y * y) - q[_RA]
        best = min(best, _thick(flat, up - q[_TH]))
        best = max(best, _cut(code[END_A], filled, x + q[_HALF], y, q[_HA], np.pi + q[_TURN]))
    if code[END_B] != PLAIN:
        flat = np.sqrt((x - q[_HALF]) ** 2 + y * y) - q[_RB]
        best = min(best, _thick(flat, up - q[_TH]))
        best = max(best, _cut(code[END_B], filled, x - q[_HALF], y, q[_HB], q[_TURN]))
    return float(best)


@compiled
def _thick(flat: float, up: float) -> float:
    """A plane distance made thick."""
    if flat > 0.0 and up > 0.0:
        return float(np.sqrt(flat * flat + up * up))
    return max(flat, up)


@compiled
def _shaft(q: FloatArray, x: float, y: float) -> float:
    """A trapezium with half widths that differ at its ends."""
    half, slope = q[_HALF], 0.5 * (q[_WB] - q[_WA]) / q[_HALF]
    wide = 0.5 * (q[_WA] + q[_WB]) + slope * min(max(x, -half), half)
    u, v = abs(x) - half, (abs(y) - wide) / np.sqrt(1.0 + slope * slope)
    return float(_thick(u, v))


@compiled
def _cut(end: int, filled: bool, x: float, y: float, hole: float, turn: float) -> float:
    """Minus the distance from what is cut out of an end: a hole, or a slot open to its outside."""
    if end == RING:
        return -np.inf if filled else hole - np.sqrt(x * x + y * y)
    if end == SLOT:
        along = x * np.cos(turn) + y * np.sin(turn)
        across = abs(-x * np.sin(turn) + y * np.cos(turn))
        return float(min(hole - across, along + 0.6 * hole))
    return -np.inf


_LENGTH, _BEND, _FLAT, _G, _BENT_MIDDLE = 8, 9, 10, 11, 16


@compiled
def prepare_bent(theta: FloatArray, q: FloatArray) -> None:
    """Fill in the metres of a bent body from its vector."""
    q[_LENGTH], q[_BEND], q[_FLAT] = np.exp(theta[ARC]), theta[BEND], np.exp(theta[FLAT])
    most = 0.0
    for k in range(GIRTH_KNOTS):
        q[_G + k] = np.exp(theta[GIRTHS + k])
        most = max(most, q[_G + k])
    q[_BENT_MIDDLE] = most * q[_FLAT]


@compiled
def bent_box(q: FloatArray, box: FloatArray) -> None:
    """Fill in the body's box in its own frame: least x, y, z, greatest x, y, z."""
    most = 0.0
    for k in range(GIRTH_KNOTS):
        most = max(most, q[_G + k])
    half = 0.5 * q[_LENGTH] + most
    # How far the ends of an arc are beside its middle.
    bow = 0.5 * q[_LENGTH] * np.tan(min(abs(0.25 * q[_BEND]), 1.5))
    box[0], box[1], box[2] = -half, -most - (bow if q[_BEND] < 0.0 else 0.0), 0.0
    box[3], box[4], box[5] = half, most + (bow if q[_BEND] > 0.0 else 0.0), 2.0 * q[_BENT_MIDDLE]


@compiled
def bent_distance(q: FloatArray, x: float, y: float, z: float) -> float:
    """Metres from the surface, negative inside."""
    half = 0.5 * q[_LENGTH]
    along, aside = x, y
    if abs(q[_BEND]) > 1e-3:
        radius = q[_LENGTH] / q[_BEND]
        # Polar coordinates about the arc's centre, which is at (0, radius).
        side = np.sign(radius)
        along = np.arctan2(x * side, (radius - y) * side) * abs(radius)
        aside = abs(radius) - np.hypot(x, radius - y)
    beyond = max(abs(along) - half, 0.0)
    at = (min(max(along, -half), half) / q[_LENGTH] + 0.5) * (GIRTH_KNOTS - 1)
    k = min(int(at), GIRTH_KNOTS - 2)
    girth = q[_G + k] + (at - k) * (q[_G + k + 1] - q[_G + k])
    slope = (q[_G + k + 1] - q[_G + k]) * (GIRTH_KNOTS - 1) / q[_LENGTH]
    flat = q[_FLAT]
    wide = np.hypot(beyond, aside)
    up = z - q[_BENT_MIDDLE]
    first = np.sqrt((wide / girth) ** 2 + (up / (girth * flat)) ** 2)
    second = np.sqrt((wide / girth**2) ** 2 + (up / (girth * flat) ** 2) ** 2)
    if second < 1e-9:
        return float(-girth * min(1.0, flat))
    return float(first * (first - 1.0) / second / np.sqrt(1.0 + slope * slope))
