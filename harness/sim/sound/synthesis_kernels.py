"""Two tables whose product is a sum of decaying sines, in machine code.

Sample ``b B + j`` of a mode is the imaginary part of ``g z^(b B) z^j``, ``z`` its step of one sample.
One table holds ``g z^(b B)`` for every block ``b``, the other ``z^j`` within one block; both come by
multiplying in double precision, so that a phase is as good after an hour as after a second. What is
then left is one product of matrices, in the precision of the tables.

Modes lie in tiles of ``TILE``: a row of a table is, tile after tile, ``TILE`` first parts and ``TILE``
second parts, so that the first tiles of a row, those that still sound, are one piece of memory.
"""

from typing import Any

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray, IntArray
from harness.basics.compiled import compiled
from harness.sim.sound.phasor import SIXTEEN, turn_double, turn_single

TILE = SIXTEEN
"""Modes side by side; two registers of eight double numbers."""


@compiled
def block_counts(
    sizes: FloatArray, dampings: FloatArray, quiet: float, block: float, blocks: int, multiple: int
) -> IntArray:
    """``(m,)``: in how many blocks each mode is louder than ``quiet``, rounded up to a multiple.

    Args:
        sizes: ``(m,)`` amplitude at time zero; a mode of size zero has no block.
        dampings: ``(m,)`` 1/s.
        quiet: amplitude below which a mode is left out.
        block: s.
        blocks: of the whole sound.
        multiple: of which a count is one, unless it is ``blocks``.
    """
    counts = np.zeros(len(sizes), dtype=np.int64)
    for mode in range(len(sizes)):
        if sizes[mode] <= quiet:
            continue
        longest = np.log(sizes[mode] / quiet)
        needed = blocks
        if dampings[mode] * block * blocks > longest:
            needed = int(longest / (dampings[mode] * block)) + 1
        counts[mode] = min(blocks, -(-needed // multiple) * multiple)
    return counts


def fill(
    table: AnyArray, rows: IntArray, first: FloatArray, step: FloatArray, floor: float, swapped: bool
) -> None:
    """Powers of a complex step in every row of a table.

    Args:
        table: ``(n, 2 TILE t)``, float32 or float64, C-contiguous, written to.
        rows: ``(t,)``: how many rows of each tile are wanted; the others stay as they are.
        first: ``(2, TILE t)`` real and imaginary part of row 0, C-contiguous.
        step: ``(2, TILE t)`` likewise, from one row to the next.
        floor: what is smaller is zero, so that no product of two tables loses its leading bit.
        swapped: the imaginary parts come before the real ones in each tile.
    """
    _fill(table, rows, first, step, floor * floor, swapped)


@compiled
def _fill(
    table: AnyArray, rows: IntArray, first: FloatArray, step: FloatArray, least: float, swapped: bool
) -> None:
    # Known when this is compiled for a type, so that only one of both turns is in its code.
    size, wide = np.int64(table.itemsize), table.shape[1]
    out: Any = np.int64(table.ctypes.data)
    ahead: Any = np.int64(first.ctypes.data)
    on: Any = np.int64(step.ctypes.data)
    below = 8 * first.shape[1]
    for tile in range(len(rows)):
        at = out + size * 2 * TILE * tile
        real, imag = (at + size * TILE, at) if swapped else (at, at + size * TILE)
        lane = 8 * TILE * tile
        place, step_at, apart = ahead + lane, on + lane, size * wide
        if size == 4:
            turn_single(real, imag, apart, rows[tile], place, place + below, step_at, step_at + below, least)
        else:
            turn_double(real, imag, apart, rows[tile], place, place + below, step_at, step_at + below, least)


@compiled
def largest_rest(
    sizes: FloatArray, dampings: FloatArray, counts: IntArray, block: float, blocks: int, multiple: int
) -> float:
    """The largest that the modes left out can add up to at any time.

    Between two multiples of blocks no mode is left out and each only dies away, so that the sum of
    what their envelopes are at the multiples bounds it.

    Args:
        sizes: ``(m,)`` amplitude at time zero.
        dampings: ``(m,)`` 1/s.
        counts: ``(m,)`` blocks in which each is heard, see ``block_counts``.
        block: s.
        blocks: of the whole sound.
        multiple: as for ``block_counts``.
    """
    rests = np.zeros(blocks // multiple + 1)
    for mode in range(len(sizes)):
        if counts[mode] >= blocks:
            continue
        left = sizes[mode] * np.exp(-dampings[mode] * block * counts[mode])
        slower = np.exp(-dampings[mode] * block * multiple)
        for at in range(counts[mode] // multiple, len(rests)):
            if left < 1e-60:
                break
            rests[at] += left
            left *= slower
    return float(rests.max())
