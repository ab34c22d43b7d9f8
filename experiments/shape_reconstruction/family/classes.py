"""Classes of household things, and shapes drawn from each: the family's prior.

Sizes are what such things are sold in, rounded outward: tableware by makers' lists (mugs of 0.2 to 0.5 l,
plates of 150 to 300 mm, bowls of 100 to 260 mm, stemmed glasses of 130 to 260 mm), cans by the American can
sizes (202 to 603, that is 54 to 157 mm across), bottles and jugs by their litres (0.2 to 2.5), pans by hob
sizes (140 to 300 mm), spanners by DIN 3113 (8 to 32 mm across flats, 100 to 350 mm long, heads 2.0 to 2.4
times the flats), packets and boards by kitchen shelves (20 to 350 mm). Walls are 2 to 5 mm of cups and jugs,
3 to 6 mm of stoneware, 1 to 3 mm of glass. None is of an object of the bench's tables.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType

import numpy as np

from experiments.shape_reconstruction.family import layout
from experiments.shape_reconstruction.family.layout import (
    BAR,
    BENT,
    CORED,
    DISC,
    FLAT_SIDED,
    KNOTS,
    LOOP,
    PLAIN,
    RING,
    SLOT,
    SUPER,
    TOOL,
    TURNED,
)
from harness.basics.arrays import FloatArray, IntArray

_MM = 1e-3
_Random = np.random.Generator
_FLAT = 0.7
"""Depth over width of a bottle below which its sides are flat."""

_EVEN = np.linspace(0.0, 1.0, KNOTS)


@dataclass(frozen=True, eq=False)
class FamilyShape:
    """One shape."""

    name: str  #: its class.
    code: IntArray  #: ``(CODE_SIZE,)``: its kind and parts.
    theta: FloatArray  #: ``(SIZE,)``, its numbers, about the origin.


def draw_shape(name: str, random: _Random) -> FamilyShape:
    """A shape of a class, standing at the origin, its yaw zero."""
    code = np.zeros(layout.CODE_SIZE, np.int64)
    theta = np.zeros(layout.SIZE)
    CLASSES[name](random, code, theta)
    return FamilyShape(name, code, theta)


PART = 3.0
"""Natural logarithm of how much rarer a thing is with a part that no draw of its class has."""

SOLID = 6.0
"""The same of a vessel that is solid, of a solid body that is open, and of one that widens to its top."""

NARROW = 0.35
"""Width over length of a vessel below which it is a trough: as rare as a solid one."""

_UNNAMED = {"knob": 2.0, "vase": 2.0}
"""The same of classes that hold any round shape: what has a name of its own is seen more often."""

_SAMPLE = 40


def rarity(shape: FamilyShape) -> float:
    """Natural logarithm of how much rarer such a thing is, with such parts, than an ordinary one."""
    code, theta = shape.code, shape.theta
    apart = (np.array(codes_of(shape.name)) != code).astype(np.float64)
    apart[:, layout.HOLLOW] *= SOLID / PART
    price = PART * float(apart.sum(axis=1).min()) + _UNNAMED.get(shape.name, 0.0)
    radii = theta[layout.RADII : layout.RADII + KNOTS]
    # Vessels are widest at the top, and solid things are not.
    widens = code[layout.KIND] == TURNED and radii[-1] > radii.max() - 0.1 and radii[-1] > radii[0] + 0.15
    if widens and code[layout.HOLLOW] == 0 and not apart[:, layout.HOLLOW].any():
        price += SOLID
    if code[layout.PLAN] == CORED and code[layout.HOLLOW] != 0:
        # No vessel with straight sides that is drawn is much longer than wide.
        sides = np.exp(theta[[layout.CORE_X, layout.CORE_Y]]) + np.exp(radii.max())
        if sides.min() < NARROW * sides.max():
            price += SOLID
    return price


@lru_cache(maxsize=64)
def codes_of(name: str) -> tuple[tuple[int, ...], ...]:
    """Kinds and combinations of parts that draws of a class have."""
    random = np.random.default_rng(0)
    found = {tuple(int(part) for part in draw_shape(name, random).code) for _ in range(_SAMPLE)}
    return tuple(sorted(found))


def add_part(shape: FamilyShape, part: int, random: _Random) -> FamilyShape:
    """Draw a handle (``layout.LIMB``) or a spout (``layout.SPOUT``) and add it to a turned body."""
    code, theta = shape.code.copy(), shape.theta.copy()
    if part == layout.LIMB:
        _loop(random, code, theta, float(np.exp(theta[layout.HEIGHT])))
    else:
        widest = float(np.exp(theta[layout.RADII : layout.RADII + KNOTS].max()))
        _spout(random, code, theta, 2.0 * widest)
    return FamilyShape(shape.name, code, theta)


def _between(random: _Random, low: float, high: float) -> float:
    """Of a size in m, given in mm: as many small as large by ratio."""
    return float(np.exp(random.uniform(np.log(low), np.log(high)))) * _MM


def _turn(
    random: _Random,
    code: IntArray,
    theta: FloatArray,
    height: float,
    radii: FloatArray,
    shares: FloatArray = _EVEN,
    wall: float = 0.0,
    floor: float = 0.0,
) -> None:
    """A section of radii in m at shares of a height; hollow where there is a wall."""
    code[layout.KIND], code[layout.HOLLOW] = TURNED, int(wall > 0.0)
    wave = np.cumsum(random.normal(0.0, 0.012, KNOTS))
    theta[layout.HEIGHT] = np.log(height)
    theta[layout.RADII : layout.RADII + KNOTS] = np.log(radii) + wave - wave.mean()
    theta[layout.SHARES : layout.SHARES + KNOTS] = shares
    theta[layout.WALL] = np.log(wall or 3.0 * _MM)
    theta[layout.FLOOR] = np.log(floor or 4.0 * _MM)
    for slot in (layout.CORE_X, layout.CORE_Y):
        theta[slot] = np.log(1e-6)
    theta[layout.POWER] = np.log(2.0)


def _core(code: IntArray, theta: FloatArray, half_x: float, half_y: float) -> None:
    code[layout.PLAN] = CORED
    theta[layout.CORE_X], theta[layout.CORE_Y] = np.log(half_x), np.log(half_y)


def _loop(random: _Random, code: IntArray, theta: FloatArray, height: float) -> None:
    """A handle that a finger or a hand goes through."""
    code[layout.LIMB] = LOOP
    theta[layout.LIMB_AT] = random.uniform(0.4, 0.65)
    theta[layout.LIMB_HALF] = np.log(height * random.uniform(0.2, 0.4))
    theta[layout.LIMB_REACH] = np.log(_between(random, 18.0, 48.0))
    theta[layout.LIMB_SLANT] = random.normal(0.0, 0.1)
    theta[layout.LIMB_CORNER] = random.normal(0.3, 0.7)
    theta[layout.LIMB_THICK] = np.log(_between(random, 3.0, 8.0))
    theta[layout.LIMB_WIDE] = np.log(_between(random, 4.0, 13.0))


def _spout(random: _Random, code: IntArray, theta: FloatArray, width: float) -> None:
    code[layout.SPOUT] = 1
    theta[layout.SPOUT_AT] = random.uniform(0.3, 0.6)
    theta[layout.SPOUT_REACH] = np.log(width * random.uniform(0.35, 0.8))
    theta[layout.SPOUT_RISE] = random.uniform(0.3, 1.3)
    theta[layout.SPOUT_ROOT] = np.log(_between(random, 10.0, 24.0))
    theta[layout.SPOUT_TIP] = np.log(_between(random, 5.0, 11.0))


def _cup(random: _Random, code: IntArray, theta: FloatArray) -> None:
    height, radius = _between(random, 60.0, 150.0), _between(random, 30.0, 55.0)
    foot, rim = random.uniform(0.65, 1.0), random.uniform(0.92, 1.1)
    radii = radius * np.interp(_EVEN, [0.0, random.uniform(0.15, 1.0), 1.0], [foot, 1.0, rim])
    wall = _between(random, 2.2, 5.0)
    _turn(random, code, theta, height, radii, wall=wall, floor=wall * random.uniform(1.0, 2.5))


def _mug(random: _Random, code: IntArray, theta: FloatArray) -> None:
    _cup(random, code, theta)
    _loop(random, code, theta, float(np.exp(theta[layout.HEIGHT])))


def _dish(random: _Random, radius: float, foot: float) -> tuple[FloatArray, FloatArray]:
    """Radii and shares of the height along a curve that leaves the foot outward and ends upright or not."""
    turn = 0.5 * np.pi * _EVEN * random.uniform(0.5, 1.0)
    out, up = np.sin(turn) / np.sin(turn[-1]), (1.0 - np.cos(turn)) / (1.0 - np.cos(turn[-1]))
    return radius * (foot + (1.0 - foot) * out), up


def _bowl(random: _Random, code: IntArray, theta: FloatArray) -> None:
    radius = _between(random, 50.0, 130.0)
    height = radius * random.uniform(0.45, 1.1)
    radii, shares = _dish(random, radius, random.uniform(0.3, 0.65))
    wall = _between(random, 3.0, 6.0)
    _turn(random, code, theta, height, radii, shares, wall, wall * random.uniform(1.0, 2.5))


def _plate(random: _Random, code: IntArray, theta: FloatArray) -> None:
    radius = _between(random, 70.0, 160.0)
    height = radius * random.uniform(0.12, 0.35)
    radii, shares = _dish(random, radius, random.uniform(0.4, 0.75))
    wall = _between(random, 3.5, 6.0)
    _turn(random, code, theta, height, radii, shares, wall, wall * random.uniform(1.0, 2.0))


def _bottle(random: _Random, code: IntArray, theta: FloatArray) -> None:
    height, radius = _between(random, 120.0, 320.0), _between(random, 22.0, 55.0)
    shoulder, neck = random.uniform(0.45, 0.8), random.uniform(0.25, 0.6)
    shares = np.array([0.0, 0.04, 0.5 * shoulder, shoulder, 0.5 * (1.0 + shoulder), 0.93, 1.0])
    knots, widths = [0.0, 0.04, shoulder, 0.5 * (1.0 + shoulder), 1.0], [0.92, 1.0, 1.0, neck + 0.1, neck]
    wall = _between(random, 1.0, 4.0) if random.random() < 0.3 else 0.0
    _turn(random, code, theta, height, radius * np.interp(shares, knots, widths), shares, wall, 2.0 * wall)


def _flat_bottle(random: _Random, code: IntArray, theta: FloatArray) -> None:
    """The flatter half with flat sides below a round neck, the other oval all the way up."""
    _bottle(random, code, theta)
    across = random.uniform(0.45, 0.95)
    code[layout.PLAN], code[layout.HOLLOW] = (FLAT_SIDED if across < _FLAT else SUPER), 0
    theta[layout.ACROSS] = np.log(across)
    theta[layout.POWER] = np.log(random.uniform(2.0, 4.5))


def _can(random: _Random, code: IntArray, theta: FloatArray) -> None:
    height, radius = _between(random, 40.0, 220.0), _between(random, 25.0, 80.0)
    _turn(random, code, theta, height, np.full(KNOTS, radius))


def _stemmed(random: _Random, code: IntArray, theta: FloatArray) -> None:
    height, widest = _between(random, 120.0, 260.0), _between(random, 24.0, 55.0)
    low, belly = random.uniform(0.25, 0.5), random.uniform(0.6, 0.85)
    stem = _between(random, 3.0, 7.0)
    shares = np.array([0.0, 0.03, 0.1, low, 0.5 * (low + belly), belly, 1.0])
    foot, rim = random.uniform(0.7, 1.0) * widest, random.uniform(0.65, 1.05) * widest
    radii = np.array([foot, 0.8 * foot, stem, stem, 0.85 * widest, widest, rim])
    wall = _between(random, 1.2, 2.5)
    _turn(random, code, theta, height, radii, shares, wall, height * low + 2.0 * wall)


def _jug(random: _Random, code: IntArray, theta: FloatArray) -> None:
    height, radius = _between(random, 130.0, 290.0), _between(random, 40.0, 85.0)
    waist, rim = random.uniform(0.65, 1.0), random.uniform(0.7, 1.05)
    knots = [0.0, random.uniform(0.2, 0.45), random.uniform(0.7, 0.85), 1.0]
    radii = radius * np.interp(_EVEN, knots, [random.uniform(0.75, 1.0), 1.0, waist, rim])
    wall = _between(random, 2.2, 4.5)
    _turn(random, code, theta, height, radii, wall=wall, floor=wall * random.uniform(1.0, 2.0))
    _loop(random, code, theta, height)
    theta[layout.LIMB_WIDE] = np.log(_between(random, 6.0, 16.0))


def _teapot(random: _Random, code: IntArray, theta: FloatArray) -> None:
    radius = _between(random, 50.0, 100.0)
    height = radius * random.uniform(1.1, 2.2)
    belly, lid = random.uniform(0.35, 0.55), random.uniform(0.15, 0.6)
    radii = radius * np.interp(_EVEN, [0.0, belly, 0.85, 1.0], [random.uniform(0.5, 0.8), 1.0, 0.75, lid])
    wall = _between(random, 2.0, 5.0) if random.random() < 0.25 else 0.0
    _turn(random, code, theta, height, radii, wall=wall, floor=1.5 * wall)
    _loop(random, code, theta, height)
    _spout(random, code, theta, 2.0 * radius)


def _any_round(random: _Random) -> tuple[float, FloatArray]:
    """A height and radii that wander."""
    height, radius = _between(random, 40.0, 260.0), _between(random, 20.0, 85.0)
    steps = np.cumsum(np.cumsum(random.normal(0.0, 0.12, KNOTS)) * 0.7 + random.normal(0.0, 0.06, KNOTS))
    return height, radius * np.exp(steps - steps.max())


def _vase(random: _Random, code: IntArray, theta: FloatArray) -> None:
    height, radii = _any_round(random)
    wall = _between(random, 3.0, 6.0)
    _turn(random, code, theta, height, radii, wall=wall, floor=1.5 * wall)


def _knob(random: _Random, code: IntArray, theta: FloatArray) -> None:
    height, radii = _any_round(random)
    _turn(random, code, theta, height, radii)


def _ball(random: _Random, code: IntArray, theta: FloatArray) -> None:
    radius = _between(random, 25.0, 75.0)
    height = 2.0 * radius * random.uniform(0.7, 1.5)
    shares = 0.5 - 0.5 * np.cos(np.pi * np.linspace(0.07, 0.93, KNOTS))
    radii = radius * np.sin(np.pi * np.linspace(0.07, 0.93, KNOTS))
    _turn(random, code, theta, height, radii, (shares - shares[0]) / (shares[-1] - shares[0]))


def _pan(random: _Random, code: IntArray, theta: FloatArray) -> None:
    radius = _between(random, 65.0, 155.0)
    height = radius * random.uniform(0.25, 1.2)
    radii = radius * np.linspace(random.uniform(0.7, 1.0), 1.0, KNOTS)
    wall = _between(random, 1.5, 5.0)
    _turn(random, code, theta, height, radii, wall=wall, floor=wall * random.uniform(1.0, 2.0))
    code[layout.LIMB] = BAR
    theta[layout.LIMB_AT] = random.uniform(0.6, 1.0)
    theta[layout.LIMB_HALF] = np.log(10.0 * _MM)
    theta[layout.LIMB_REACH] = np.log(_between(random, 90.0, 240.0))
    theta[layout.LIMB_SLANT] = random.normal(0.1, 0.12)
    theta[layout.LIMB_THICK] = np.log(_between(random, 4.0, 10.0))
    theta[layout.LIMB_WIDE] = np.log(_between(random, 7.0, 16.0))


def _tray(random: _Random, code: IntArray, theta: FloatArray) -> None:
    half = _between(random, 55.0, 220.0)
    half_y, height = half * random.uniform(0.45, 1.0), _between(random, 12.0, 70.0)
    corner = half_y * random.uniform(0.1, 0.5)
    wall = _between(random, 3.0, 9.0)
    radii = corner * np.linspace(random.uniform(0.6, 1.0), 1.0, KNOTS)
    _turn(random, code, theta, height, radii, wall=wall, floor=wall * random.uniform(0.7, 1.5))
    _core(code, theta, half - corner, half_y - corner)


def _packet(random: _Random, code: IntArray, theta: FloatArray) -> None:
    sides = np.sort([_between(random, 20.0, 320.0) for _ in range(3)])
    if sides[2] > 8.0 * sides[0]:
        sides[0] = sides[2] / 8.0
    random.shuffle(sides)
    corner = 0.5 * min(sides[0], sides[1]) * random.uniform(0.03, 0.4)
    _turn(random, code, theta, sides[2], np.full(KNOTS, corner))
    _core(code, theta, 0.5 * sides[0] - corner, 0.5 * sides[1] - corner)


def _board(random: _Random, code: IntArray, theta: FloatArray) -> None:
    thick = 0.5 * _between(random, 2.0, 20.0)
    _turn(random, code, theta, _between(random, 60.0, 300.0), np.full(KNOTS, 0.98 * thick))
    _core(code, theta, 0.5 * _between(random, 60.0, 350.0), 0.02 * thick)


def _square_cup(random: _Random, code: IntArray, theta: FloatArray) -> None:
    half, height = _between(random, 28.0, 80.0), _between(random, 50.0, 200.0)
    corner = half * random.uniform(0.15, 0.7)
    wall = _between(random, 2.5, 5.0)
    radii = corner * np.linspace(random.uniform(0.75, 1.0), 1.0, KNOTS)
    _turn(random, code, theta, height, radii, wall=wall, floor=1.5 * wall)
    _core(code, theta, half - corner, (half - corner) * random.uniform(0.6, 1.0))
    if random.random() < 0.4:
        _loop(random, code, theta, height)


def _spanner(random: _Random, code: IntArray, theta: FloatArray) -> None:
    flats = _between(random, 8.0, 34.0)
    length = flats * random.uniform(7.5, 13.0)
    ends = [(SLOT, RING), (SLOT, SLOT), (RING, RING), (SLOT, PLAIN)][random.integers(4)]
    _tool(code, theta, length, ends)
    for end, slot, hole in ((ends[0], layout.HEAD_A, layout.HOLE_A), (ends[1], layout.HEAD_B, layout.HOLE_B)):
        theta[slot] = np.log(flats * (random.uniform(1.0, 1.2) if end == SLOT else random.uniform(0.7, 0.95)))
        theta[hole] = np.log(0.5 * flats)
    shaft = np.log(0.5 * flats * random.uniform(0.6, 1.1))
    theta[layout.SHAFT_A], theta[layout.SHAFT_B] = shaft, shaft + random.normal(0.0, 0.15)
    theta[layout.SHAFT_THICK] = np.log(0.5 * flats * random.uniform(0.25, 0.5))
    theta[layout.HEAD_THICK] = np.log(0.5 * flats * random.uniform(0.35, 0.65))
    theta[layout.SLOT_TURN] = np.radians(random.choice([0.0, 15.0, -15.0]))


def _tool(code: IntArray, theta: FloatArray, length: float, ends: tuple[int, int]) -> None:
    code[layout.KIND], code[layout.END_A], code[layout.END_B] = TOOL, ends[0], ends[1]
    theta[layout.LENGTH] = np.log(length)
    theta[layout.HOLE_A] = theta[layout.HOLE_B] = np.log(6.0 * _MM)
    theta[layout.HEAD_A] = theta[layout.HEAD_B] = np.log(12.0 * _MM)


def _utensil(random: _Random, code: IntArray, theta: FloatArray) -> None:
    """Spatulas, knives, brushes, rulers, bars: a shaft, and an end or two of another width."""
    length, half = _between(random, 70.0, 330.0), 0.5 * _between(random, 6.0, 45.0)
    kinds = (PLAIN, DISC, RING)
    ends = (int(random.choice(kinds)), int(random.choice((PLAIN, PLAIN, DISC))))
    _tool(code, theta, length, ends)
    theta[layout.SHAFT_A] = np.log(half)
    theta[layout.SHAFT_B] = np.log(half * random.uniform(0.5, 1.6))
    theta[layout.SHAFT_THICK] = np.log(0.5 * _between(random, 3.0, 30.0))
    theta[layout.HEAD_THICK] = theta[layout.SHAFT_THICK] + random.normal(0.0, 0.4)
    for slot, hole in ((layout.HEAD_A, layout.HOLE_A), (layout.HEAD_B, layout.HOLE_B)):
        theta[slot] = np.log(half * random.uniform(1.1, 3.0))
        theta[hole] = theta[slot] + np.log(random.uniform(0.3, 0.75))


def _bent(random: _Random, code: IntArray, theta: FloatArray) -> None:
    """Fruit, grips, tubes: round, lying, straight or bent."""
    code[layout.KIND] = BENT
    length, girth = _between(random, 60.0, 280.0), _between(random, 8.0, 35.0)
    theta[layout.ARC], theta[layout.BEND] = np.log(length), random.uniform(0.0, 1.8) * (random.random() < 0.7)
    ends = random.uniform(0.3, 1.1, 2)
    shape = np.array([ends[0], 0.5 * (1.0 + ends[0]), 1.0, 0.5 * (1.0 + ends[1]), ends[1]])
    theta[layout.GIRTHS : layout.GIRTHS + layout.GIRTH_KNOTS] = np.log(girth * shape)
    theta[layout.FLAT] = np.log(random.uniform(0.7, 1.05))


CLASSES: MappingProxyType[str, Callable[[_Random, IntArray, FloatArray], None]] = MappingProxyType(
    {
        "mug": _mug, "cup": _cup, "bowl": _bowl, "plate": _plate, "bottle": _bottle,
        "flat bottle": _flat_bottle, "can": _can, "stemmed glass": _stemmed, "jug": _jug, "teapot": _teapot,
        "vase": _vase, "knob": _knob, "ball": _ball, "pan": _pan, "tray": _tray, "packet": _packet,
        "board": _board, "square cup": _square_cup, "spanner": _spanner, "utensil": _utensil,
        "bent body": _bent,
    }
)  # fmt: skip
"""How each class draws a shape's code and vector."""


DRAWS = 200
"""Of each class, whose sizes are taken."""

OWN = 0.15
"""Logarithm that a size differs by beside: draws end at makers' lists, things do not."""

TAIL = 4.0
"""Degrees of freedom of sizes: the fewer, the less odd is one far from all draws."""


def size_of(code: IntArray, theta: FloatArray) -> tuple[float, float]:
    """M: half the width and the height of a shape, roughly."""
    kind = int(code[layout.KIND])
    if kind == TOOL:
        return 0.5 * float(np.exp(theta[layout.LENGTH])), 2.0 * float(np.exp(theta[layout.HEAD_THICK]))
    if kind == BENT:
        girth = float(np.exp(theta[layout.GIRTHS + 2]))
        return 0.5 * float(np.exp(theta[layout.ARC])), 2.0 * girth
    half = float(np.exp(theta[layout.RADII : layout.RADII + KNOTS].max()))
    if code[layout.PLAN] == CORED:
        half += 0.7 * float(np.exp(theta[layout.CORE_X]) + np.exp(theta[layout.CORE_Y]))
    if code[layout.PLAN] in (SUPER, FLAT_SIDED):
        half *= 0.5 * (1.0 + float(np.exp(theta[layout.ACROSS])))
    if code[layout.LIMB] == LOOP:
        half += 0.35 * float(np.exp(theta[layout.LIMB_REACH]))
    return half, float(np.exp(theta[layout.HEIGHT]))


def rarity_of_size(shape: FamilyShape) -> float:
    """Natural logarithm of how much rarer a thing of a class's width and height is than an ordinary one.

    A draw is scaled to what was seen, and then fitted: a stemmed glass as low and wide as a bowl, which fits
    a bowl's outline and a press at its rim, is none. By Student's density of two numbers, about the class's.
    Of 24 development runs answers by 4 presses and a picture are 1.66 mm off without it and 1.62 with it, and
    by 8 and 32 the same.
    """
    middle, precision = _ordinary(shape.name)
    off = np.log(size_of(shape.code, shape.theta)) - middle
    return float(0.5 * (TAIL + 2.0) * np.log1p(off @ precision @ off / TAIL))


@lru_cache(maxsize=64)
def _ordinary(name: str) -> tuple[FloatArray, FloatArray]:
    """``(2,)`` middle of the logarithms of a class's widths and heights, ``(2, 2)`` their precision."""
    random = np.random.default_rng(1)
    shapes = [draw_shape(name, random) for _ in range(DRAWS)]
    sizes = np.log([size_of(shape.code, shape.theta) for shape in shapes])
    spread = np.cov(sizes.T) + OWN**2 * np.eye(2)
    return np.asarray(sizes.mean(axis=0)), np.asarray(np.linalg.inv(spread))
