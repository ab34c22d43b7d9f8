"""Signed distance of any shape of the family in the frame ``stand``, and of flat tools and bent bodies."""

import numpy as np

from experiments.shape_reconstruction.family.layout import (
    ACROSS,
    ARC,
    BAR,
    BEND,
    CORE_X,
    CORE_Y,
    CORED,
    END_A,
    END_B,
    FLAT,
    FLAT_SIDED,
    FLOOR,
    GIRTH_KNOTS,
    GIRTHS,
    HEAD_A,
    HEAD_B,
    HEAD_THICK,
    HEIGHT,
    HOLE_A,
    HOLE_B,
    HOLLOW,
    KIND,
    KNOTS,
    LENGTH,
    LIFT,
    LIMB,
    LIMB_AT,
    LIMB_CORNER,
    LIMB_HALF,
    LIMB_REACH,
    LIMB_SLANT,
    LIMB_THICK,
    LIMB_WIDE,
    LOOP,
    NO_LIMB,
    PLAIN,
    PLAN,
    POWER,
    RADII,
    RING,
    ROUND,
    SHAFT_A,
    SHAFT_B,
    SHAFT_THICK,
    SHARES,
    SLOT,
    SLOT_TURN,
    SPOUT,
    SPOUT_AT,
    SPOUT_REACH,
    SPOUT_RISE,
    SPOUT_ROOT,
    SPOUT_TIP,
    TILT_X,
    TILT_Y,
    TOOL,
    TURNED,
    WALL,
    WARP,
    YAW,
    X,
    Y,
)
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
    # The shaft is a trapezium with half widths that differ at its ends.
    half, slope = q[_HALF], 0.5 * (q[_WB] - q[_WA]) / q[_HALF]
    wide = 0.5 * (q[_WA] + q[_WB]) + slope * min(max(x, -half), half)
    shaft = _thick(abs(x) - half, (abs(y) - wide) / np.sqrt(1.0 + slope * slope))
    best = _thick(shaft, up - q[_TS])
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


# Of the prepared numbers: metres, as the distance needs them.
_H, _WALL, _FLOOR, _BX, _BY, _ACROSS, _POWER = 8, 9, 10, 11, 12, 13, 14
_R, _Z = 15, 22
_LIMB_Z, _LIMB_HALF, _LIMB_OUT, _LIMB_SLANT, _LIMB_CORNER, _LIMB_A, _LIMB_B = 29, 30, 31, 32, 33, 34, 35
_SPOUT = 36
_SLIGHT = 0.25
"""Least slope that a distance is computed with: beside a kink of a flat side it would be none."""

_SLOPE, _INVERSE = 42, 48
"""Of the side's pieces: radius over height, and one over the squared length."""


@compiled
def prepare_turned(code: IntArray, theta: FloatArray, q: FloatArray) -> None:
    """Fill in the metres of a shape from its vector."""
    height = np.exp(theta[HEIGHT])
    q[_H], q[_WALL], q[_FLOOR] = height, np.exp(theta[WALL]), np.exp(theta[FLOOR])
    q[_BX], q[_BY] = np.exp(theta[CORE_X]), np.exp(theta[CORE_Y])
    q[_ACROSS], q[_POWER] = np.exp(theta[ACROSS]), np.exp(theta[POWER])
    if code[PLAN] == FLAT_SIDED:
        q[_ACROSS] *= np.exp(np.max(theta[RADII : RADII + KNOTS]))
    power = np.exp(theta[WARP])
    for k in range(KNOTS):
        q[_R + k] = np.exp(theta[RADII + k])
        q[_Z + k] = height * theta[SHARES + k] ** power
    for k in range(KNOTS - 1):
        out, up = q[_R + k + 1] - q[_R + k], max(q[_Z + k + 1] - q[_Z + k], 1e-9)
        q[_SLOPE + k], q[_INVERSE + k] = out / up, 1.0 / (out * out + up * up)
    if code[LIMB] != NO_LIMB:
        q[_LIMB_Z] = theta[LIMB_AT] * q[_H]
        q[_LIMB_HALF] = np.exp(theta[LIMB_HALF])
        q[_LIMB_OUT] = _reach_of(code, q, q[_LIMB_Z]) + np.exp(theta[LIMB_REACH])
        q[_LIMB_SLANT] = theta[LIMB_SLANT]
        round_ = 1.0 / (1.0 + np.exp(-theta[LIMB_CORNER]))
        q[_LIMB_CORNER] = round_ * min(q[_LIMB_HALF], q[_LIMB_OUT])
        q[_LIMB_A], q[_LIMB_B] = np.exp(theta[LIMB_THICK]), np.exp(theta[LIMB_WIDE])
    if code[SPOUT] != 0:
        z = theta[SPOUT_AT] * q[_H]
        wall, reach = _reach_of(code, q, z), np.exp(theta[SPOUT_REACH])
        q[_SPOUT], q[_SPOUT + 1] = 0.6 * wall, z
        q[_SPOUT + 2] = wall + reach
        q[_SPOUT + 3] = z + theta[SPOUT_RISE] * reach
        q[_SPOUT + 4], q[_SPOUT + 5] = np.exp(theta[SPOUT_ROOT]), np.exp(theta[SPOUT_TIP])


@compiled
def _reach_of(code: IntArray, q: FloatArray, z: float) -> float:
    """How far the wall is from the axis, along x, at a height."""
    core = q[_BX] if code[PLAN] == CORED else 0.0
    if z <= q[_Z]:
        return float(core + q[_R])
    for k in range(KNOTS - 1):
        low, high = q[_Z + k], q[_Z + k + 1]
        if z <= high:
            share = (z - low) / max(high - low, 1e-9)
            return float(core + q[_R + k] + share * (q[_R + k + 1] - q[_R + k]))
    return float(core + q[_R + KNOTS - 1])


@compiled
def turned_box(code: IntArray, q: FloatArray, box: FloatArray) -> None:
    """Fill in the body's box in its own frame: least x, y, z, greatest x, y, z."""
    out = 0.0
    for k in range(KNOTS):
        out = max(out, q[_R + k])
    box[0], box[1], box[2], box[3], box[4], box[5] = -out, -out, 0.0, out, out, q[_H]
    if code[PLAN] == CORED:
        box[0], box[1], box[3], box[4] = -out - q[_BX], -out - q[_BY], out + q[_BX], out + q[_BY]
    elif code[PLAN] == FLAT_SIDED:
        box[1], box[4] = -min(out, q[_ACROSS]), min(out, q[_ACROSS])
    elif code[PLAN] != ROUND:
        box[1], box[4] = -out * q[_ACROSS], out * q[_ACROSS]
    if code[LIMB] != NO_LIMB:
        lean = abs(q[_LIMB_SLANT]) * (q[_LIMB_HALF] if code[LIMB] == LOOP else q[_LIMB_OUT])
        half = q[_LIMB_HALF] if code[LIMB] == LOOP else lean
        box[3] = max(box[3], q[_LIMB_OUT] + lean + q[_LIMB_A])
        box[2] = min(box[2], q[_LIMB_Z] - half - q[_LIMB_A])
        box[5] = max(box[5], q[_LIMB_Z] + half + q[_LIMB_A])
        box[1], box[4] = min(box[1], -q[_LIMB_B]), max(box[4], q[_LIMB_B])
    if code[SPOUT] != 0:
        wide = max(q[_SPOUT + 4], q[_SPOUT + 5])
        box[0] = min(box[0], -q[_SPOUT + 2] - wide)
        box[2] = min(box[2], min(q[_SPOUT + 1], q[_SPOUT + 3]) - wide)
        box[5] = max(box[5], max(q[_SPOUT + 1], q[_SPOUT + 3]) + wide)
        box[1], box[4] = min(box[1], -wide), max(box[4], wide)


@compiled
def turned_distance(code: IntArray, q: FloatArray, filled: bool, x: float, y: float, z: float) -> float:
    """Metres from the body's surface, negative inside.

    ``filled`` closes a handle's hole, as masks do, and a vessel up to its rim, which no ray of sight gets
    through: how far a ray goes in is then not how thick the wall is.
    """
    side = _side(code, q, x, y, z)
    body = max(side, max(-z, z - q[_H]))
    if code[LIMB] == LOOP and x > 0.0:
        body = min(body, _loop(q, filled, x, y, z))
    elif code[LIMB] == BAR and x > 0.0:
        line = z - q[_LIMB_Z] - q[_LIMB_SLANT] * x
        body = min(body, max(_ellipse(line, y, q[_LIMB_A], q[_LIMB_B]), x - q[_LIMB_OUT]))
    if code[SPOUT] != 0 and x < 0.0:
        body = min(body, _spout(q, x, y, z))
    if code[HOLLOW] != 0 and not filled:
        body = max(body, -max(side + q[_WALL], q[_FLOOR] - z))
    return float(body)


@compiled
def _side(code: IntArray, q: FloatArray, x: float, y: float, z: float) -> float:
    """Distance from the section's outer side, which goes on straight below the foot and above the rim."""
    stretch, level = 1.0, 1.0
    if code[PLAN] == ROUND:
        rho = np.sqrt(x * x + y * y)
    elif code[PLAN] == CORED:
        u, v = abs(x) - q[_BX], abs(y) - q[_BY]
        rho = _corner(u, v)
    else:
        p, across, held = q[_POWER], q[_ACROSS], 0.0
        if code[PLAN] == FLAT_SIDED:
            across, held = _flattened(_radius_at(q, z), across)
        u, v = abs(x), abs(y) / across
        most = max(u, v)
        if most < 1e-9:
            rho = 0.0
        else:
            rho = most * ((u / most) ** p + (v / most) ** p) ** (1.0 / p)
            stretch = np.hypot((u / rho) ** (p - 1.0), (v / rho) ** (p - 1.0) / across)
            level = 1.0 - held * (v / rho) ** p
    return float(_from_section(q, rho, z, stretch, level))


@compiled
def _flattened(radius: float, half: float) -> tuple[float, float]:
    """Depth over width where flat sides are ``half`` m from the middle, and how far they hold that depth.

    The depth is about the lesser of the two, with a soft change from one to the other. It follows the width
    where the second number is zero, and does not where that is one.
    """
    wide, deep = radius**2, half**2
    wide, deep = wide * wide, deep * deep
    wide, deep = wide * wide, deep * deep
    return half / np.sqrt(np.sqrt(np.sqrt(wide + deep))), wide / (wide + deep)


@compiled
def _radius_at(q: FloatArray, z: float) -> float:
    if z <= q[_Z]:
        return float(q[_R])
    for k in range(KNOTS - 1):
        if z < q[_Z + k + 1]:
            return float(q[_R + k] + (z - q[_Z + k]) * q[_SLOPE + k])
    return float(q[_R + KNOTS - 1])


@compiled
def _corner(u: float, v: float) -> float:
    """Distance from a quarter plane's corner, of what is beyond its two sides by ``u`` and ``v``."""
    if u > 0.0 and v > 0.0:
        return float(np.sqrt(u * u + v * v))
    return float(max(u, v))


@compiled
def _from_section(q: FloatArray, rho: float, z: float, stretch: float, level: float) -> float:
    """Distance from the side; pieces next to the height first, others only as far as they can be nearer.

    ``stretch`` is the slope of ``rho`` across; ``level`` is how much of the side's own slope a place has.
    """
    last = KNOTS - 2
    k = 0
    while k < last and z > q[_Z + k + 1]:
        k += 1
    if z <= q[_Z]:
        edge = q[_R]
    elif z >= q[_Z + last + 1]:
        edge = q[_R + last + 1]
    else:
        edge = q[_R + k] + (z - q[_Z + k]) * q[_SLOPE + k]
    best, dr, dz = np.inf, 0.0, 0.0
    if z <= q[_Z] or z >= q[_Z + last + 1]:
        best, dr = (rho - edge) ** 2, rho - edge
    for i in range(k, last + 1):
        below = q[_Z + i] - z
        if below > 0.0 and below * below >= best:
            break
        gr, gz = _from_piece(q, i, rho, z)
        if gr * gr + gz * gz < best:
            best, dr, dz = gr * gr + gz * gz, gr, gz
    for i in range(k - 1, -1, -1):
        above = z - q[_Z + i + 1]
        if above > 0.0 and above * above >= best:
            break
        gr, gz = _from_piece(q, i, rho, z)
        if gr * gr + gz * gz < best:
            best, dr, dz = gr * gr + gz * gz, gr, gz
    gap = np.sqrt(best)
    if (stretch != 1.0 or level != 1.0) and gap > 1e-12:
        gap = best / max(np.sqrt((dr * stretch) ** 2 + (dz * level) ** 2), _SLIGHT * gap)
    return float(-gap if rho < edge else gap)


@compiled
def _from_piece(q: FloatArray, i: int, rho: float, z: float) -> tuple[float, float]:
    """From the nearest place of a straight piece of the side, in radius and height."""
    er, ez = q[_R + i + 1] - q[_R + i], q[_Z + i + 1] - q[_Z + i]
    pr, pz = rho - q[_R + i], z - q[_Z + i]
    share = min(max((pr * er + pz * ez) * q[_INVERSE + i], 0.0), 1.0)
    return pr - share * er, pz - share * ez


@compiled
def _loop(q: FloatArray, filled: bool, x: float, y: float, z: float) -> float:
    """A handle along a rectangle with round corners about the axis, of elliptic section."""
    up = z - q[_LIMB_Z]
    u = abs(x - q[_LIMB_SLANT] * up) - q[_LIMB_OUT] + q[_LIMB_CORNER]
    v = abs(up) - q[_LIMB_HALF] + q[_LIMB_CORNER]
    line = _corner(u, v) - q[_LIMB_CORNER]
    if filled:
        line = max(line, 0.0)
    return float(_ellipse(line, y, q[_LIMB_A], q[_LIMB_B]))


@compiled
def _ellipse(u: float, v: float, a: float, b: float) -> float:
    """Distance from an ellipse of half axes ``a``, ``b``; first order near it (Quilez)."""
    s, t = (u / a) ** 2, (v / b) ** 2
    first = np.sqrt(s + t)
    second = np.sqrt(s / (a * a) + t / (b * b))
    if second < 1e-9:
        return float(-min(a, b))
    return float(first * (first - 1.0) / second)


@compiled
def _spout(q: FloatArray, x: float, y: float, z: float) -> float:
    """A round cone from within the wall out along -x."""
    ax, az, bx, bz = q[_SPOUT], q[_SPOUT + 1], q[_SPOUT + 2], q[_SPOUT + 3]
    ex, ez = bx - ax, bz - az
    px, pz = -x - ax, z - az
    share = min(max((px * ex + pz * ez) / max(ex * ex + ez * ez, 1e-18), 0.0), 1.0)
    gap = np.sqrt((px - share * ex) ** 2 + y * y + (pz - share * ez) ** 2)
    return float(gap - q[_SPOUT + 4] - share * (q[_SPOUT + 5] - q[_SPOUT + 4]))
