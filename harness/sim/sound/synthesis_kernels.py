"""Two tables whose product is a sum of decaying sines, in machine code.

Sample ``b B + j`` of a mode is the imaginary part of ``g z^(b B) z^j``, ``z`` its step of one sample.
One table holds ``g z^(b B)`` for every block ``b``, the other ``z^j`` within one block; both come by
multiplying in double precision, so that a phase is as good after an hour as after a second. What is
then left is one product of matrices, in the precision of the tables.

Modes lie in tiles of ``TILE``: a row of a table is, tile after tile, ``TILE`` first parts and ``TILE``
second parts, so that the first tiles of a row, those that still sound, are one piece of memory.

Powers of sixteen complex steps at a time, held in registers from row to row.

Loops of numba write each power to memory and read it again, which took nine times as long. Registers
narrower than sixteen numbers are used in pairs or more: LLVM splits what the machine does not have.
"""

import threading
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from harness.basics.arrays import AnyArray, FloatArray, IntArray
from harness.basics.compiled import compiled

TILE = 16
"""Modes side by side; two registers of eight double numbers."""

_NUMBER = ir.DoubleType()
_VECTOR = ir.VectorType(_NUMBER, TILE)
_BYTES = 8
_MAY_FUSE = ("contract",)
_loop: Any = cgutils.for_range
_variable: Any = cgutils.alloca_once

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


def _loaded(builder: Any, place: Any) -> Any:
    """Sixteen numbers at an address."""
    return builder.load(builder.inttoptr(place, _VECTOR.as_pointer()), align=_BYTES)


def _product(builder: Any, left: Any, right: Any) -> Any:
    return builder.fmul(left, right, flags=_MAY_FUSE)


def _turning(element: Any) -> Callable[..., Any]:
    """Code that writes rows of powers as numbers of one type.

    Called with the addresses of the first row's real and imaginary parts, the bytes from one row to
    the next, the number of rows, the addresses of the real and imaginary parts of the first power
    and of the step, and the square below which a part is written as zero.
    """
    row = ir.VectorType(element, TILE)
    narrow = element != _NUMBER

    def code(
        _typing: Any, _real: Any, _imag: Any, _apart: Any, _rows: Any, _first_re: Any, _first_im: Any,
        _step_re: Any, _step_im: Any, _least: Any,
    ) -> Any:  # fmt: skip
        def generate(context: Any, builder: Any, _signature: Any, given: Any) -> Any:
            *outs, apart, rows, first_re, first_im, step_re, step_im, square = given
            step = (_loaded(builder, step_re), _loaded(builder, step_im))
            # One number, sixteen times.
            first = ir.Constant(ir.IntType(32), 0)
            alone = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), square, first)
            lanes = ir.Constant(ir.VectorType(ir.IntType(32), TILE), [0] * TILE)
            least = builder.shuffle_vector(alone, alone, lanes)
            power = [_variable(builder, _VECTOR) for _ in outs]
            for part, place in zip(power, (first_re, first_im), strict=True):
                builder.store(_loaded(builder, place), part)
            with _loop(builder, rows) as loop:
                on = builder.mul(apart, loop.index)
                now = (builder.load(power[0]), builder.load(power[1]))
                for part, out in zip(now, outs, strict=True):
                    loud = builder.fcmp_ordered(">", builder.fmul(part, part), least)
                    kept = builder.select(loud, part, ir.Constant(_VECTOR, [0.0] * TILE))
                    written = builder.fptrunc(kept, row) if narrow else kept
                    to = builder.inttoptr(builder.add(out, on), row.as_pointer())
                    builder.store(written, to, align=4 if narrow else _BYTES)
                # Real and imaginary part of the product of two complex numbers.
                lost = _product(builder, now[1], step[1])
                gained = _product(builder, now[1], step[0])
                real = builder.fsub(_product(builder, now[0], step[0]), lost, flags=_MAY_FUSE)
                imag = builder.fadd(_product(builder, now[0], step[1]), gained, flags=_MAY_FUSE)
                for part, value in zip(power, (real, imag), strict=True):
                    builder.store(value, part)
            return context.get_dummy_value()

        return types.void(*[types.int64] * 8, types.float64), generate

    return code


turn_single: Any = intrinsic(_turning(ir.FloatType()))
turn_double: Any = intrinsic(_turning(_NUMBER))

MEMORY = Memory()
"""Of whoever sums a sound."""
