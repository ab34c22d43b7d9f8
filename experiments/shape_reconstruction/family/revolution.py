"""Bodies of revolution: vessels, bottles, cans, trays and packets, with handles, bars and spouts."""

from collections.abc import Iterator
from types import MappingProxyType

import numpy as np

from experiments.shape_reconstruction import thresholds as limits
from experiments.shape_reconstruction.family.kind import (
    MM,
    FamilyShape,
    Random,
    ShapeKind,
    Traits,
    sample_length,
)
from experiments.shape_reconstruction.family.layout import REVOLUTION
from experiments.shape_reconstruction.family.revolution_distance import (
    BAR,
    CORED,
    FLAT_SIDED,
    HOLLOW,
    KNOTS,
    LIMB,
    LOOP,
    NO_LIMB,
    PLAN,
    ROUND,
    SIZE,
    SLOT,
    SPOUT,
    SUPER,
)
from harness.basics.arrays import FloatArray, IntArray

LOOPS, TURNS = 3, 8
"""Handles that are sampled where there is none, and yaws that each is tried at."""

_FLAT = 0.7
"""Depth over width of a bottle below which its sides are flat."""

_EVEN = np.linspace(0.0, 1.0, KNOTS)


def _turn(
    random: Random,
    code: IntArray,
    theta: FloatArray,
    height: float,
    radii: FloatArray,
    shares: FloatArray = _EVEN,
    wall: float = 0.0,
    floor: float = 0.0,
) -> None:
    """A section of radii in m at shares of a height; hollow where there is a wall."""
    code[HOLLOW] = int(wall > 0.0)
    wave = np.cumsum(random.normal(0.0, 0.012, KNOTS))
    theta[SLOT.height] = np.log(height)
    theta[SLOT.radii] = np.log(radii) + wave - wave.mean()
    theta[SLOT.shares] = shares
    theta[SLOT.wall] = np.log(wall or 3.0 * MM)
    theta[SLOT.floor] = np.log(floor or 4.0 * MM)
    theta[[SLOT.core_x, SLOT.core_y]] = np.log(1e-6)
    theta[SLOT.power] = np.log(2.0)


def _core(code: IntArray, theta: FloatArray, half_x: float, half_y: float) -> None:
    code[PLAN] = CORED
    theta[SLOT.core_x], theta[SLOT.core_y] = np.log(half_x), np.log(half_y)


def _loop(random: Random, code: IntArray, theta: FloatArray, height: float) -> None:
    """A handle that a finger or a hand goes through."""
    code[LIMB] = LOOP
    theta[SLOT.limb_at] = random.uniform(0.4, 0.65)
    theta[SLOT.limb_half] = np.log(height * random.uniform(0.2, 0.4))
    theta[SLOT.limb_reach] = np.log(sample_length(random, 18.0, 48.0))
    theta[SLOT.limb_slant] = random.normal(0.0, 0.1)
    theta[SLOT.limb_corner] = random.normal(0.3, 0.7)
    theta[SLOT.limb_thick] = np.log(sample_length(random, 3.0, 8.0))
    theta[SLOT.limb_wide] = np.log(sample_length(random, 4.0, 13.0))


def _spout(random: Random, code: IntArray, theta: FloatArray, width: float) -> None:
    code[SPOUT] = 1
    theta[SLOT.spout_at] = random.uniform(0.3, 0.6)
    theta[SLOT.spout_reach] = np.log(width * random.uniform(0.35, 0.8))
    theta[SLOT.spout_rise] = random.uniform(0.3, 1.3)
    theta[SLOT.spout_root] = np.log(sample_length(random, 10.0, 24.0))
    theta[SLOT.spout_tip] = np.log(sample_length(random, 5.0, 11.0))


def _cup(random: Random, code: IntArray, theta: FloatArray) -> None:
    height, radius = sample_length(random, 60.0, 150.0), sample_length(random, 30.0, 55.0)
    foot, rim = random.uniform(0.65, 1.0), random.uniform(0.92, 1.1)
    radii = radius * np.interp(_EVEN, [0.0, random.uniform(0.15, 1.0), 1.0], [foot, 1.0, rim])
    wall = sample_length(random, 2.2, 5.0)
    _turn(random, code, theta, height, radii, wall=wall, floor=wall * random.uniform(1.0, 2.5))


def _mug(random: Random, code: IntArray, theta: FloatArray) -> None:
    _cup(random, code, theta)
    _loop(random, code, theta, float(np.exp(theta[SLOT.height])))


def _dish(random: Random, radius: float, foot: float) -> tuple[FloatArray, FloatArray]:
    turn = 0.5 * np.pi * _EVEN * random.uniform(0.5, 1.0)
    out, up = np.sin(turn) / np.sin(turn[-1]), (1.0 - np.cos(turn)) / (1.0 - np.cos(turn[-1]))
    return radius * (foot + (1.0 - foot) * out), up


def _bowl(random: Random, code: IntArray, theta: FloatArray) -> None:
    radius = sample_length(random, 50.0, 130.0)
    height = radius * random.uniform(0.45, 1.1)
    radii, shares = _dish(random, radius, random.uniform(0.3, 0.65))
    wall = sample_length(random, 3.0, 6.0)
    _turn(random, code, theta, height, radii, shares, wall, wall * random.uniform(1.0, 2.5))


def _plate(random: Random, code: IntArray, theta: FloatArray) -> None:
    radius = sample_length(random, 70.0, 160.0)
    height = radius * random.uniform(0.12, 0.35)
    radii, shares = _dish(random, radius, random.uniform(0.4, 0.75))
    wall = sample_length(random, 3.5, 6.0)
    _turn(random, code, theta, height, radii, shares, wall, wall * random.uniform(1.0, 2.0))


def _bottle(random: Random, code: IntArray, theta: FloatArray) -> None:
    height, radius = sample_length(random, 120.0, 320.0), sample_length(random, 22.0, 55.0)
    shoulder, neck = random.uniform(0.45, 0.8), random.uniform(0.25, 0.6)
    shares = np.array([0.0, 0.04, 0.5 * shoulder, shoulder, 0.5 * (1.0 + shoulder), 0.93, 1.0])
    knots, widths = [0.0, 0.04, shoulder, 0.5 * (1.0 + shoulder), 1.0], [0.92, 1.0, 1.0, neck + 0.1, neck]
    wall = sample_length(random, 1.0, 4.0) if random.random() < 0.3 else 0.0
    _turn(random, code, theta, height, radius * np.interp(shares, knots, widths), shares, wall, 2.0 * wall)


def _flat_bottle(random: Random, code: IntArray, theta: FloatArray) -> None:
    """The flatter half with flat sides below a round neck, the other oval all the way up."""
    _bottle(random, code, theta)
    across = random.uniform(0.45, 0.95)
    code[PLAN], code[HOLLOW] = (FLAT_SIDED if across < _FLAT else SUPER), 0
    theta[SLOT.across] = np.log(across)
    theta[SLOT.power] = np.log(random.uniform(2.0, 4.5))


def _can(random: Random, code: IntArray, theta: FloatArray) -> None:
    height, radius = sample_length(random, 40.0, 220.0), sample_length(random, 25.0, 80.0)
    _turn(random, code, theta, height, np.full(KNOTS, radius))


def _stemmed(random: Random, code: IntArray, theta: FloatArray) -> None:
    height, widest = sample_length(random, 120.0, 260.0), sample_length(random, 24.0, 55.0)
    low, belly = random.uniform(0.25, 0.5), random.uniform(0.6, 0.85)
    stem = sample_length(random, 3.0, 7.0)
    shares = np.array([0.0, 0.03, 0.1, low, 0.5 * (low + belly), belly, 1.0])
    foot, rim = random.uniform(0.7, 1.0) * widest, random.uniform(0.65, 1.05) * widest
    radii = np.array([foot, 0.8 * foot, stem, stem, 0.85 * widest, widest, rim])
    wall = sample_length(random, 1.2, 2.5)
    _turn(random, code, theta, height, radii, shares, wall, height * low + 2.0 * wall)


def _jug(random: Random, code: IntArray, theta: FloatArray) -> None:
    height, radius = sample_length(random, 130.0, 290.0), sample_length(random, 40.0, 85.0)
    waist, rim = random.uniform(0.65, 1.0), random.uniform(0.7, 1.05)
    knots = [0.0, random.uniform(0.2, 0.45), random.uniform(0.7, 0.85), 1.0]
    radii = radius * np.interp(_EVEN, knots, [random.uniform(0.75, 1.0), 1.0, waist, rim])
    wall = sample_length(random, 2.2, 4.5)
    _turn(random, code, theta, height, radii, wall=wall, floor=wall * random.uniform(1.0, 2.0))
    _loop(random, code, theta, height)
    theta[SLOT.limb_wide] = np.log(sample_length(random, 6.0, 16.0))


def _teapot(random: Random, code: IntArray, theta: FloatArray) -> None:
    radius = sample_length(random, 50.0, 100.0)
    height = radius * random.uniform(1.1, 2.2)
    belly, lid = random.uniform(0.35, 0.55), random.uniform(0.15, 0.6)
    radii = radius * np.interp(_EVEN, [0.0, belly, 0.85, 1.0], [random.uniform(0.5, 0.8), 1.0, 0.75, lid])
    wall = sample_length(random, 2.0, 5.0) if random.random() < 0.25 else 0.0
    _turn(random, code, theta, height, radii, wall=wall, floor=1.5 * wall)
    _loop(random, code, theta, height)
    _spout(random, code, theta, 2.0 * radius)


def _any_round(random: Random) -> tuple[float, FloatArray]:
    height, radius = sample_length(random, 40.0, 260.0), sample_length(random, 20.0, 85.0)
    steps = np.cumsum(np.cumsum(random.normal(0.0, 0.12, KNOTS)) * 0.7 + random.normal(0.0, 0.06, KNOTS))
    return height, radius * np.exp(steps - steps.max())


def _vase(random: Random, code: IntArray, theta: FloatArray) -> None:
    height, radii = _any_round(random)
    wall = sample_length(random, 3.0, 6.0)
    _turn(random, code, theta, height, radii, wall=wall, floor=1.5 * wall)


def _knob(random: Random, code: IntArray, theta: FloatArray) -> None:
    height, radii = _any_round(random)
    _turn(random, code, theta, height, radii)


def _ball(random: Random, code: IntArray, theta: FloatArray) -> None:
    radius = sample_length(random, 25.0, 75.0)
    height = 2.0 * radius * random.uniform(0.7, 1.5)
    shares = 0.5 - 0.5 * np.cos(np.pi * np.linspace(0.07, 0.93, KNOTS))
    radii = radius * np.sin(np.pi * np.linspace(0.07, 0.93, KNOTS))
    _turn(random, code, theta, height, radii, (shares - shares[0]) / (shares[-1] - shares[0]))


def _pan(random: Random, code: IntArray, theta: FloatArray) -> None:
    radius = sample_length(random, 65.0, 155.0)
    height = radius * random.uniform(0.25, 1.2)
    radii = radius * np.linspace(random.uniform(0.7, 1.0), 1.0, KNOTS)
    wall = sample_length(random, 1.5, 5.0)
    _turn(random, code, theta, height, radii, wall=wall, floor=wall * random.uniform(1.0, 2.0))
    code[LIMB] = BAR
    theta[SLOT.limb_at] = random.uniform(0.6, 1.0)
    theta[SLOT.limb_half] = np.log(10.0 * MM)
    theta[SLOT.limb_reach] = np.log(sample_length(random, 90.0, 240.0))
    theta[SLOT.limb_slant] = random.normal(0.1, 0.12)
    theta[SLOT.limb_thick] = np.log(sample_length(random, 4.0, 10.0))
    theta[SLOT.limb_wide] = np.log(sample_length(random, 7.0, 16.0))


def _tray(random: Random, code: IntArray, theta: FloatArray) -> None:
    half = sample_length(random, 55.0, 220.0)
    half_y, height = half * random.uniform(0.45, 1.0), sample_length(random, 12.0, 70.0)
    corner = half_y * random.uniform(0.1, 0.5)
    wall = sample_length(random, 3.0, 9.0)
    radii = corner * np.linspace(random.uniform(0.6, 1.0), 1.0, KNOTS)
    _turn(random, code, theta, height, radii, wall=wall, floor=wall * random.uniform(0.7, 1.5))
    _core(code, theta, half - corner, half_y - corner)


def _packet(random: Random, code: IntArray, theta: FloatArray) -> None:
    sides = np.sort([sample_length(random, 20.0, 320.0) for _ in range(3)])
    if sides[2] > 8.0 * sides[0]:
        sides[0] = sides[2] / 8.0
    random.shuffle(sides)
    corner = 0.5 * min(sides[0], sides[1]) * random.uniform(0.03, 0.4)
    _turn(random, code, theta, sides[2], np.full(KNOTS, corner))
    _core(code, theta, 0.5 * sides[0] - corner, 0.5 * sides[1] - corner)


def _board(random: Random, code: IntArray, theta: FloatArray) -> None:
    thick = 0.5 * sample_length(random, 2.0, 20.0)
    _turn(random, code, theta, sample_length(random, 60.0, 300.0), np.full(KNOTS, 0.98 * thick))
    _core(code, theta, 0.5 * sample_length(random, 60.0, 350.0), 0.02 * thick)


def _square_cup(random: Random, code: IntArray, theta: FloatArray) -> None:
    half, height = sample_length(random, 28.0, 80.0), sample_length(random, 50.0, 200.0)
    corner = half * random.uniform(0.15, 0.7)
    wall = sample_length(random, 2.5, 5.0)
    radii = corner * np.linspace(random.uniform(0.75, 1.0), 1.0, KNOTS)
    _turn(random, code, theta, height, radii, wall=wall, floor=1.5 * wall)
    _core(code, theta, half - corner, (half - corner) * random.uniform(0.6, 1.0))
    if random.random() < 0.4:
        _loop(random, code, theta, height)


class BodyOfRevolution(ShapeKind):
    """A section swept round a plan, hollow or solid, with a handle, bar or spout."""

    number = REVOLUTION
    size = SIZE
    is_elongated = False
    lengths = (
        SLOT.height, *SLOT.radii, SLOT.wall, SLOT.floor, SLOT.core_x, SLOT.core_y, SLOT.limb_half,
        SLOT.limb_reach, SLOT.limb_thick, SLOT.limb_wide, SLOT.spout_reach, SLOT.spout_root, SLOT.spout_tip,
    )  # fmt: skip
    width, height = int(SLOT.radii[0]), SLOT.height
    section = tuple(SLOT.radii)
    classes = MappingProxyType(
        {
            "mug": _mug, "cup": _cup, "bowl": _bowl, "plate": _plate, "bottle": _bottle,
            "flat bottle": _flat_bottle, "can": _can, "stemmed glass": _stemmed, "jug": _jug,
            "teapot": _teapot, "vase": _vase, "knob": _knob, "ball": _ball, "pan": _pan, "tray": _tray,
            "packet": _packet, "board": _board, "square cup": _square_cup,
        }
    )  # fmt: skip

    def deviations(self, code: IntArray) -> dict[int, float]:
        """Return one standard deviation of each free parameter about its sample, by slot."""
        free = {SLOT.height: 0.3, SLOT.warp: 0.15}
        if code[HOLLOW] != 0:
            free |= {SLOT.wall: 0.35, SLOT.floor: 0.4}
        free |= dict.fromkeys(SLOT.radii, 0.35)
        if code[PLAN] == CORED:
            free |= {SLOT.core_x: 0.35, SLOT.core_y: 0.35}
        if code[PLAN] in (SUPER, FLAT_SIDED):
            free |= {SLOT.across: 0.25, SLOT.power: 0.3}
        if code[LIMB] != NO_LIMB:
            free |= {
                SLOT.limb_at: 0.12, SLOT.limb_reach: 0.3, SLOT.limb_slant: 0.15, SLOT.limb_thick: 0.25,
                SLOT.limb_wide: 0.25,
            }  # fmt: skip
        if code[LIMB] == LOOP:
            free |= {SLOT.limb_half: 0.25, SLOT.limb_corner: 0.7}
        if code[SPOUT] != 0:
            free |= {
                SLOT.spout_at: 0.12, SLOT.spout_reach: 0.3, SLOT.spout_rise: 0.4, SLOT.spout_root: 0.25,
                SLOT.spout_tip: 0.25,
            }  # fmt: skip
        return free

    def extent(self, code: IntArray, theta: FloatArray) -> tuple[float, float]:
        """Compute half the width and the height of a shape roughly, m."""
        half = float(np.exp(theta[SLOT.radii].max()))
        if code[PLAN] == CORED:
            half += 0.7 * float(np.exp(theta[SLOT.core_x]) + np.exp(theta[SLOT.core_y]))
        if code[PLAN] in (SUPER, FLAT_SIDED):
            half *= 0.5 * (1.0 + float(np.exp(theta[SLOT.across])))
        if code[LIMB] == LOOP:
            half += 0.35 * float(np.exp(theta[SLOT.limb_reach]))
        return half, float(np.exp(theta[SLOT.height]))

    def traits(self, code: IntArray) -> Traits:
        """Return what the parts of a shape imply."""
        cored, bar = code[PLAN] == CORED, code[LIMB] == BAR
        return Traits(
            has_yaw=not (code[PLAN] == ROUND and code[LIMB] == NO_LIMB and code[SPOUT] == 0),
            yaw_factor=1 if code[LIMB] == NO_LIMB else 2,
            proportions=(
                *((SLOT.core_x, SLOT.core_y) if cored else ()),
                *((SLOT.limb_reach,) if bar else ()),
            ),
            walls=(SLOT.wall, SLOT.floor) if code[HOLLOW] != 0 else (),
            has_sides=bool(cored),
        )

    def rarity(self, code: IntArray, theta: FloatArray, agrees: bool) -> float:
        """Compute the natural logarithm of the rarity of a solid body that widens, and of a trough."""
        radii = theta[SLOT.radii]
        # Vessels are widest at the top, and solid things are not.
        widens = radii[-1] > radii.max() - 0.1 and radii[-1] > radii[0] + 0.15
        if widens and code[HOLLOW] == 0 and agrees:
            return limits.SOLID_RARITY
        if code[PLAN] == CORED and code[HOLLOW] != 0:
            # No vessel with straight sides that is sampled is much longer than wide.
            sides = np.exp(theta[[SLOT.core_x, SLOT.core_y]]) + np.exp(radii.max())
            if sides.min() < limits.MIN_VESSEL_WIDTH * sides.max():
                return limits.SOLID_RARITY
        return 0.0

    def set_sides(self, theta: FloatArray, half: FloatArray) -> None:
        """Set ``(2,)`` half sides of a body with a rectangular plan, m."""
        corner = float(np.exp(theta[SLOT.radii].max()))
        theta[[SLOT.core_x, SLOT.core_y]] = np.log(np.maximum(half - corner, 0.1 * half))

    def changes(self, shape: FamilyShape, random: Random) -> Iterator[FamilyShape]:
        """Yield shapes with one part added, removed or exchanged, or rotated to a look-alike pose."""
        code = shape.code
        yield shape.with_part(HOLLOW, 1 - int(code[HOLLOW]))
        if code[LIMB] != NO_LIMB:
            yield shape.with_part(LIMB, NO_LIMB)
            yield shape.rotate(0.5 * np.pi)
            yield shape.rotate(-0.5 * np.pi)
        if code[LIMB] != LOOP:
            for _ in range(LOOPS):
                looped, first = _add_limb(shape, random), random.uniform(0.0, 2.0 * np.pi)
                for turn in range(TURNS):
                    yield looped.rotate(first + 2.0 * np.pi * turn / TURNS)
        if code[SPOUT] != 0:
            yield shape.with_part(SPOUT, 0)
        elif code[LIMB] == LOOP:
            yield _add_spout(shape, random)
        if code[PLAN] == ROUND:
            yield _oval(shape, SUPER, 0.9)
            if code[HOLLOW] == 0:
                yield _oval(shape, FLAT_SIDED, 0.7)
        elif code[PLAN] in (SUPER, FLAT_SIDED):
            yield shape.with_part(PLAN, ROUND)
            if code[HOLLOW] == 0:
                yield shape.with_part(PLAN, SUPER if code[PLAN] == FLAT_SIDED else FLAT_SIDED)
        elif code[PLAN] == CORED:
            yield shape.rotate(0.5 * np.pi)


def _add_limb(shape: FamilyShape, random: Random) -> FamilyShape:
    code, theta = shape.code.copy(), shape.theta.copy()
    _loop(random, code, theta, float(np.exp(theta[SLOT.height])))
    return FamilyShape(shape.name, code, theta)


def _add_spout(shape: FamilyShape, random: Random) -> FamilyShape:
    code, theta = shape.code.copy(), shape.theta.copy()
    _spout(random, code, theta, 2.0 * float(np.exp(theta[SLOT.radii].max())))
    return FamilyShape(shape.name, code, theta)


def _oval(shape: FamilyShape, plan: int, across: float) -> FamilyShape:
    theta: FloatArray = shape.theta.copy()
    theta[SLOT.across], theta[SLOT.power] = np.log(across), np.log(2.2)
    return FamilyShape(shape.name, shape.code, theta).with_part(PLAN, plan)
