"""Signed distance of a body of revolution: a section swept round a plan, with handle, bar and spout."""

from typing import Generic, NamedTuple, TypeVar, cast

import numpy as np

from experiments.shape_reconstruction.family.layout import POSE_SIZE
from harness.basics.arrays import FloatArray, IntArray
from harness.basics.compiled import compiled

KNOTS = 7  #: heights at which a section has a radius.

HOLLOW, PLAN, LIMB, SPOUT = 1, 2, 3, 4
"""Entries of a code: the parts of a body of revolution."""
ROUND, CORED, SUPER, FLAT_SIDED = 0, 1, 2, 3
"""Plans: a circle, a rounded rectangle, a superellipse of one shape at all heights, and a superellipse with
flat sides of one depth, which is round where the section is narrower than that, as at a bottle's neck."""
NO_LIMB, LOOP, BAR = 0, 1, 2
"""Limbs: none, a handle that a finger goes through, and a bar as of a pan."""

_S = TypeVar("_S")
_A = TypeVar("_A")


class RevolutionParameters(NamedTuple, Generic[_S, _A]):
    """Parameters of a body of revolution, or their slots. Lengths are logarithms of metres."""

    height: _S  #: from the foot to the rim.
    radii: _A  #: ``(KNOTS,)``, from the foot to the rim.
    warp: _S  #: logarithm of the power that ``shares`` are raised to.
    wall: _S  #: thickness of the wall of a hollow body.
    floor: _S  #: thickness of its floor.
    core_x: _S  #: half side of the rectangle that the section is swept round.
    core_y: _S  #: the other half side.
    across: _S
    """logarithm of y over x of a superelliptic plan, at the widest height where sides are flat."""
    power: _S  #: logarithm of the power of a superelliptic plan.
    limb_at: _S  #: height of the middle of a handle over the body's.
    limb_half: _S  #: half the height of a handle.
    limb_reach: _S  #: distance that it stands out of the wall.
    limb_slant: _S  #: slope of its outer bar.
    limb_corner: _S  #: logit of the relative radius of its corners.
    limb_thick: _S  #: half its thickness in its plane.
    limb_wide: _S  #: half its thickness across its plane.
    spout_at: _S  #: height of the root of a spout over the body's.
    spout_reach: _S  #: distance that it stands out of the wall.
    spout_rise: _S  #: its rise over that.
    spout_root: _S  #: radius at its root.
    spout_tip: _S  #: radius at its tip.
    shares: _A  #: ``(KNOTS,)`` heights of the radii over the body's; not fitted.


def _by_name(own: FloatArray) -> RevolutionParameters[float, FloatArray]:
    return RevolutionParameters(
        own[0], own[1:8], own[8], own[9], own[10], own[11], own[12], own[13], own[14], own[15], own[16],
        own[17], own[18], own[19], own[20], own[21], own[22], own[23], own[24], own[25], own[26], own[27:34],
    )  # fmt: skip


_parameters = compiled(_by_name)

SIZE = POSE_SIZE + 34  #: numbers of a body of revolution's vector.

SLOT = cast(RevolutionParameters[int, IntArray], _by_name(cast(FloatArray, np.arange(POSE_SIZE, SIZE))))
"""Slot of each parameter in a shape's vector."""

_H, _WALL, _FLOOR, _BX, _BY, _ACROSS, _POWER = 8, 9, 10, 11, 12, 13, 14
_R, _Z = 15, 22
_LIMB_Z, _LIMB_HALF, _LIMB_OUT, _LIMB_SLANT, _LIMB_CORNER, _LIMB_A, _LIMB_B = 29, 30, 31, 32, 33, 34, 35
_SPOUT = 36
_SLIGHT = 0.25
"""Least slope that a distance is computed with: beside a kink of a flat side it would be none."""

_SLOPE, _INVERSE = 42, 48
"""Offsets of the pieces of the side: radius over height, and one over the squared length."""


@compiled
def prepare_revolution(code: IntArray, own: FloatArray, q: FloatArray) -> None:
    """Fill in the metres of a body from its parameters ``own``."""
    p = _parameters(own)
    height = np.exp(p.height)
    q[_H], q[_WALL], q[_FLOOR] = height, np.exp(p.wall), np.exp(p.floor)
    q[_BX], q[_BY] = np.exp(p.core_x), np.exp(p.core_y)
    q[_ACROSS], q[_POWER] = np.exp(p.across), np.exp(p.power)
    if code[PLAN] == FLAT_SIDED:
        q[_ACROSS] *= np.exp(np.max(p.radii))
    power = np.exp(p.warp)
    for k in range(KNOTS):
        q[_R + k] = np.exp(p.radii[k])
        q[_Z + k] = height * p.shares[k] ** power
    for k in range(KNOTS - 1):
        out, up = q[_R + k + 1] - q[_R + k], max(q[_Z + k + 1] - q[_Z + k], 1e-9)
        q[_SLOPE + k], q[_INVERSE + k] = out / up, 1.0 / (out * out + up * up)
    if code[LIMB] != NO_LIMB:
        q[_LIMB_Z] = p.limb_at * q[_H]
        q[_LIMB_HALF] = np.exp(p.limb_half)
        q[_LIMB_OUT] = _reach_of(code, q, q[_LIMB_Z]) + np.exp(p.limb_reach)
        q[_LIMB_SLANT] = p.limb_slant
        round_ = 1.0 / (1.0 + np.exp(-p.limb_corner))
        q[_LIMB_CORNER] = round_ * min(q[_LIMB_HALF], q[_LIMB_OUT])
        q[_LIMB_A], q[_LIMB_B] = np.exp(p.limb_thick), np.exp(p.limb_wide)
    if code[SPOUT] != 0:
        z = p.spout_at * q[_H]
        wall, reach = _reach_of(code, q, z), np.exp(p.spout_reach)
        q[_SPOUT], q[_SPOUT + 1] = 0.6 * wall, z
        q[_SPOUT + 2] = wall + reach
        q[_SPOUT + 3] = z + p.spout_rise * reach
        q[_SPOUT + 4], q[_SPOUT + 5] = np.exp(p.spout_root), np.exp(p.spout_tip)


@compiled
def _reach_of(code: IntArray, q: FloatArray, z: float) -> float:
    """Compute the distance of the wall from the axis along x, at a height, m."""
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
def revolution_box(code: IntArray, q: FloatArray, box: FloatArray) -> None:
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
def revolution_distance(code: IntArray, q: FloatArray, filled: bool, x: float, y: float, z: float) -> float:
    """Compute the signed distance from the surface, m.

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
