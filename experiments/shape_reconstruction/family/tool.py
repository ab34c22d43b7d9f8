"""Flat tools: a tapered shaft between two ends, cut out of a plate; spanners and utensils."""

from collections.abc import Iterator
from types import MappingProxyType
from typing import Generic, NamedTuple, TypeVar, cast

import numpy as np

from experiments.shape_reconstruction.family.kind import MM, FamilyShape, Random, ShapeKind, sample_length
from experiments.shape_reconstruction.family.layout import POSE_SIZE, TOOL
from harness.basics.arrays import FloatArray, IntArray
from harness.basics.compiled import compiled

END_A, END_B = 5, 6
"""Entries of a code: both ends."""
PLAIN, DISC, RING, SLOTTED = 0, 1, 2, 3
"""Kinds of ends."""

_S = TypeVar("_S")


class ToolParameters(NamedTuple, Generic[_S]):
    """Parameters of a flat tool, or their slots. Lengths are logarithms of metres."""

    length: _S  #: from the middle of one end to that of the other.
    shaft_a: _S  #: half width of the shaft at one end.
    shaft_b: _S  #: half width at the other.
    shaft_thick: _S  #: half thickness of the shaft.
    head_thick: _S  #: half thickness of the ends.
    head_a: _S  #: radius of one end.
    head_b: _S  #: radius of the other.
    hole_a: _S  #: radius of the hole, or half width of the slot, of one end.
    hole_b: _S  #: the same of the other.
    slot_turn: _S  #: angle between a slot and the shaft, rad.


def _by_name(own: FloatArray) -> ToolParameters[float]:
    return ToolParameters(own[0], own[1], own[2], own[3], own[4], own[5], own[6], own[7], own[8], own[9])


_parameters = compiled(_by_name)

SIZE = POSE_SIZE + 10  #: numbers of a tool's vector.

SLOT = cast(ToolParameters[int], _by_name(cast(FloatArray, np.arange(POSE_SIZE, SIZE))))
"""Slot of each parameter in a shape's vector."""

HEADS, _HOLE = (1.4, 2.0, 2.8), 0.55
"""Half widths of a tool's head over that of its shaft there; of its hole over its own."""

_ENDS = (
    (END_A, SLOT.shaft_a, SLOT.head_a, SLOT.hole_a),
    (END_B, SLOT.shaft_b, SLOT.head_b, SLOT.hole_b),
)


_HALF, _WA, _WB, _TS, _TH, _RA, _RB, _HA, _HB, _TURN = 8, 9, 10, 11, 12, 13, 14, 15, 16, 17
_MIDDLE = 18


@compiled
def prepare_tool(code: IntArray, own: FloatArray, q: FloatArray) -> None:
    """Fill in the metres of a tool from its parameters ``own``."""
    p = _parameters(own)
    q[_HALF] = 0.5 * np.exp(p.length)
    q[_WA], q[_WB] = np.exp(p.shaft_a), np.exp(p.shaft_b)
    q[_TS], q[_TH] = np.exp(p.shaft_thick), np.exp(p.head_thick)
    q[_RA], q[_RB] = np.exp(p.head_a), np.exp(p.head_b)
    q[_HA], q[_HB] = np.exp(p.hole_a), np.exp(p.hole_b)
    q[_TURN] = p.slot_turn
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
    """Compute the signed distance from the surface, m; ``filled`` closes its holes, as masks do."""
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
    if flat > 0.0 and up > 0.0:
        return float(np.sqrt(flat * flat + up * up))
    return max(flat, up)


@compiled
def _cut(end: int, filled: bool, x: float, y: float, hole: float, turn: float) -> float:
    """Minus the distance from what is cut out of an end: a hole, or a slot open to its outside."""
    if end == RING:
        return -np.inf if filled else hole - np.sqrt(x * x + y * y)
    if end == SLOTTED:
        along = x * np.cos(turn) + y * np.sin(turn)
        across = abs(-x * np.sin(turn) + y * np.cos(turn))
        return float(min(hole - across, along + 0.6 * hole))
    return -np.inf


def _spanner(random: Random, code: IntArray, theta: FloatArray) -> None:
    flats = sample_length(random, 8.0, 34.0)
    length = flats * random.uniform(7.5, 13.0)
    ends = [(SLOTTED, RING), (SLOTTED, SLOTTED), (RING, RING), (SLOTTED, PLAIN)][random.integers(4)]
    _tool(code, theta, length, ends)
    for end, slot, hole in ((ends[0], SLOT.head_a, SLOT.hole_a), (ends[1], SLOT.head_b, SLOT.hole_b)):
        low, high = (1.0, 1.2) if end == SLOTTED else (0.7, 0.95)
        theta[slot] = np.log(flats * random.uniform(low, high))
        theta[hole] = np.log(0.5 * flats)
    shaft = np.log(0.5 * flats * random.uniform(0.6, 1.1))
    theta[SLOT.shaft_a], theta[SLOT.shaft_b] = shaft, shaft + random.normal(0.0, 0.15)
    theta[SLOT.shaft_thick] = np.log(0.5 * flats * random.uniform(0.25, 0.5))
    theta[SLOT.head_thick] = np.log(0.5 * flats * random.uniform(0.35, 0.65))
    theta[SLOT.slot_turn] = np.radians(random.choice([0.0, 15.0, -15.0]))


def _tool(code: IntArray, theta: FloatArray, length: float, ends: tuple[int, int]) -> None:
    code[END_A], code[END_B] = ends
    theta[SLOT.length] = np.log(length)
    theta[SLOT.hole_a] = theta[SLOT.hole_b] = np.log(6.0 * MM)
    theta[SLOT.head_a] = theta[SLOT.head_b] = np.log(12.0 * MM)


def _utensil(random: Random, code: IntArray, theta: FloatArray) -> None:
    """Spatulas, knives, brushes, rulers, bars: a shaft, and an end or two of another width."""
    length, half = sample_length(random, 70.0, 330.0), 0.5 * sample_length(random, 6.0, 45.0)
    kinds = (PLAIN, DISC, RING)
    ends = (int(random.choice(kinds)), int(random.choice((PLAIN, PLAIN, DISC))))
    _tool(code, theta, length, ends)
    theta[SLOT.shaft_a] = np.log(half)
    theta[SLOT.shaft_b] = np.log(half * random.uniform(0.5, 1.6))
    theta[SLOT.shaft_thick] = np.log(0.5 * sample_length(random, 3.0, 30.0))
    theta[SLOT.head_thick] = theta[SLOT.shaft_thick] + random.normal(0.0, 0.4)
    for slot, hole in ((SLOT.head_a, SLOT.hole_a), (SLOT.head_b, SLOT.hole_b)):
        theta[slot] = np.log(half * random.uniform(1.1, 3.0))
        theta[hole] = theta[slot] + np.log(random.uniform(0.3, 0.75))


class FlatTool(ShapeKind):
    """A tapered shaft between two ends, cut out of a plate."""

    number = TOOL
    size = SIZE
    lengths = tuple(range(SLOT.length, SLOT.slot_turn))
    width, height = SLOT.shaft_a, SLOT.length
    classes = MappingProxyType({"spanner": _spanner, "utensil": _utensil})

    def deviations(self, code: IntArray) -> dict[int, float]:
        """Return one standard deviation of each free parameter about its sample, by slot."""
        free = {SLOT.length: 0.35, SLOT.shaft_a: 0.3, SLOT.shaft_b: 0.3, SLOT.shaft_thick: 0.35}
        for end, _, head, hole in _ENDS:
            if code[end] != PLAIN:
                free |= {head: 0.25, SLOT.head_thick: 0.3}
            if code[end] > DISC:
                free[hole] = 0.25
        if SLOTTED in (code[END_A], code[END_B]):
            free[SLOT.slot_turn] = 0.2
        return free

    def extent(self, _code: IntArray, theta: FloatArray) -> tuple[float, float]:
        """Compute half the length and the height of a shape roughly, m."""
        return 0.5 * float(np.exp(theta[SLOT.length])), 2.0 * float(np.exp(theta[SLOT.head_thick]))

    def changes(self, shape: FamilyShape, _random: Random) -> Iterator[FamilyShape]:
        """Yield shapes with one end exchanged."""
        for end, shaft, head, hole in _ENDS:
            for kind in (PLAIN, DISC, RING, SLOTTED):
                if shape.code[end] == kind:
                    continue
                changed = shape.with_part(end, kind)
                yield changed
                for ratio in HEADS if kind != PLAIN else ():
                    theta = changed.theta.copy()
                    theta[head] = theta[shaft] + np.log(ratio)
                    theta[hole] = theta[head] + np.log(_HOLE)
                    yield FamilyShape(changed.name, changed.code, theta)
