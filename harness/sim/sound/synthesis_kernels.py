"""Two tables whose product is a sum of decaying sines.

Sample ``b B + j`` of a mode is the imaginary part of ``g z^(b B) z^j``, ``z`` its step of one sample.
One table holds ``g z^(b B)`` for every block ``b``, the other ``z^j`` within one block; both come by
multiplying in double precision, so that a phase is as good after an hour as after a second. What is
then left is one product of matrices, in the precision of the tables.

Modes lie in tiles of ``TILE``: a row of a table is, tile after tile, ``TILE`` first parts and ``TILE``
second parts, so that the first tiles of a row, those that still sound, are one piece of memory.
"""

import threading
from typing import Any

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray, IntArray
from harness.basics.compiled import compiled

TILE = 16
"""Modes side by side: a row of them is turned at once, in the registers of vectors."""

_KEPT = 1 << 24
"""Bytes of working memory that a thread keeps from one sound to the next."""


class Memory(threading.local):
    """Memory of one thread, handed out piece by piece and used again by its next sound.

    Fresh memory has to be cleared by the system page by page, which took as long as all the
    arithmetic of a sound of 512 modes.
    """

    def __init__(self) -> None:
        self._bytes = np.empty(0, np.uint8)
        self._used = self._wanted = 0

    def forget(self) -> None:
        """Begin a sound: all pieces are free again, and as many bytes there as the last one took."""
        size = min(self._wanted, _KEPT)
        if size > len(self._bytes):
            self._bytes = np.empty(size, np.uint8)
        self._used = self._wanted = 0

    def piece(self, shape: tuple[int, int], kind: np.dtype[Any]) -> AnyArray:
        """An array with whatever was there before."""
        size = -(-int(np.prod(shape)) * kind.itemsize // 64) * 64
        self._wanted += size
        if self._used + size > len(self._bytes):
            return np.empty(shape, kind)
        begin, self._used = self._used, self._used + size
        return self._bytes[begin : begin + size].view(kind)[: shape[0] * shape[1]].reshape(shape)


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


@compiled
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
    least = floor * floor
    power_re, power_im = np.empty(TILE), np.empty(TILE)
    for tile in range(len(rows)):
        lane, real, imag = TILE * tile, 2 * TILE * tile, 2 * TILE * tile
        if swapped:
            real += TILE
        else:
            imag += TILE
        step_re, step_im = step[0, lane : lane + TILE], step[1, lane : lane + TILE]
        for k in range(TILE):
            power_re[k], power_im[k] = first[0, lane + k], first[1, lane + k]
        for row in range(rows[tile]):
            out = table[row]
            for k in range(TILE):
                re, im = power_re[k], power_im[k]
                out[real + k] = re if re * re > least else 0.0
                out[imag + k] = im if im * im > least else 0.0
                power_re[k] = re * step_re[k] - im * step_im[k]
                power_im[k] = re * step_im[k] + im * step_re[k]


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


MEMORY = Memory()
"""Of whoever sums a sound."""
