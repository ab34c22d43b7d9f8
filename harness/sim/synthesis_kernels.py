"""Two tables whose product is a sum of decaying sines, in machine code.

Sample ``b B + j`` of a mode is the imaginary part of ``g z^(b B) z^j``, ``z`` its step of one sample.
One table holds ``g z^(b B)`` for every block ``b``, the other ``z^j`` within one block; both come by
multiplying in double precision, so that a phase is as good after an hour as after a second. What is
then left is one product of matrices, in the precision of the tables.

Modes lie in tiles of ``TILE``: a row of a table is, tile after tile, ``TILE`` first parts and ``TILE``
second parts, so that the first tiles of a row, those that still sound, are one piece of memory.
"""

import numpy as np

from harness.arrays import AnyArray, FloatArray, IntArray
from harness.sim.compiled import compiled, compiled_fast

TILE = 16
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


@compiled_fast
def fill(
    table: AnyArray, rows: IntArray, first: FloatArray, step: FloatArray, floor: float, swapped: bool
) -> None:
    """Powers of a complex step in every row of a table.

    Args:
        table: ``(n, 2 TILE t)``, written to.
        rows: ``(t,)``: how many rows of each tile are wanted; the others stay as they are.
        first: ``(2, TILE t)`` real and imaginary part of row 0.
        step: ``(2, TILE t)`` likewise, from one row to the next.
        floor: what is smaller is zero, so that no product of two tables loses its leading bit.
        swapped: the imaginary parts come before the real ones in each tile.
    """
    re, im = np.empty(TILE), np.empty(TILE)
    step_re, step_im = np.empty(TILE), np.empty(TILE)
    head = TILE if swapped else 0
    tail = TILE - head
    for tile in range(len(rows)):
        at = tile * TILE
        for lane in range(TILE):
            re[lane], im[lane] = first[0, at + lane], first[1, at + lane]
            step_re[lane], step_im[lane] = step[0, at + lane], step[1, at + lane]
        for row in range(rows[tile]):
            out = table[row, 2 * at : 2 * at + 2 * TILE]
            for lane in range(TILE):
                a, b = re[lane], im[lane]
                out[head + lane] = a if abs(a) > floor else 0.0
                out[tail + lane] = b if abs(b) > floor else 0.0
                turned = a * step_im[lane] + b * step_re[lane]
                re[lane] = a * step_re[lane] - b * step_im[lane]
                im[lane] = turned


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
