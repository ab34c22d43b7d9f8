"""Signed distance of a flat tool that lies: a tapered shaft with an end of its own at either side."""

import numpy as np

from experiments.shape_reconstruction.family.layout import (
    END_A,
    END_B,
    HEAD_A,
    HEAD_B,
    HEAD_THICK,
    HOLE_A,
    HOLE_B,
    LENGTH,
    PLAIN,
    RING,
    SHAFT_A,
    SHAFT_B,
    SHAFT_THICK,
    SLOT,
    SLOT_TURN,
)
from harness.basics.arrays import FloatArray, IntArray
from harness.basics.compiled import compiled

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
