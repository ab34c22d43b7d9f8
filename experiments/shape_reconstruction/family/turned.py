"""Signed distance of a turned body: vessels, bottles, trays, boxes, with a handle and a spout or without.

A section (radius, height) is swept round an axis, a rectangle or a superellipse. Distances are exact near
smooth parts of the surface; outside of an edge they are those to its nearer side.
"""

import numpy as np

from experiments.shape_reconstruction.family.layout import (
    ACROSS,
    BAR,
    CORE_X,
    CORE_Y,
    CORED,
    FLAT_SIDED,
    FLOOR,
    HEIGHT,
    HOLLOW,
    KNOTS,
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
    PLAN,
    POWER,
    RADII,
    ROUND,
    SHARES,
    SPOUT,
    SPOUT_AT,
    SPOUT_REACH,
    SPOUT_RISE,
    SPOUT_ROOT,
    SPOUT_TIP,
    WALL,
    WARP,
)
from harness.basics.arrays import FloatArray, IntArray
from harness.basics.compiled import compiled

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
        _prepare_limb(code, theta, q)
    if code[SPOUT] != 0:
        _prepare_spout(code, theta, q)


@compiled
def _prepare_limb(code: IntArray, theta: FloatArray, q: FloatArray) -> None:
    q[_LIMB_Z] = theta[LIMB_AT] * q[_H]
    q[_LIMB_HALF] = np.exp(theta[LIMB_HALF])
    q[_LIMB_OUT] = _reach_of(code, q, q[_LIMB_Z]) + np.exp(theta[LIMB_REACH])
    q[_LIMB_SLANT] = theta[LIMB_SLANT]
    round_ = 1.0 / (1.0 + np.exp(-theta[LIMB_CORNER]))
    q[_LIMB_CORNER] = round_ * min(q[_LIMB_HALF], q[_LIMB_OUT])
    q[_LIMB_A], q[_LIMB_B] = np.exp(theta[LIMB_THICK]), np.exp(theta[LIMB_WIDE])


@compiled
def _prepare_spout(code: IntArray, theta: FloatArray, q: FloatArray) -> None:
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
        body = min(body, _bar(q, x, y, z))
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
def _bar(q: FloatArray, x: float, y: float, z: float) -> float:
    out = q[_LIMB_OUT]
    line = z - q[_LIMB_Z] - q[_LIMB_SLANT] * x
    return float(max(_ellipse(line, y, q[_LIMB_A], q[_LIMB_B]), x - out))


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
