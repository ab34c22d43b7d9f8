"""Surfaces as GelSight writes them: TrueMap ``.tmd`` files, version 2.0.

32 bytes say what it is, a comment ends with a zero byte, then little-endian: columns and rows (uint32),
lengths and offsets along x and y in millimetres (float32), and the heights row by row in millimetres
(float32). As read and written by GelSight's own ``gsmatlab`` (``readtmd.m``, ``writetmd.m``).
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness.basics.arrays import FloatArray, read_only
from harness.basics.errors import DataRefused

_MAGIC = b"Binary TrueMap Data File v2.0\r\n\0"
_COUNTS = np.dtype([("columns", "<u4"), ("rows", "<u4"), ("length", "<f4", (2,)), ("offset", "<f4", (2,))])


@dataclass(frozen=True, eq=False)
class TrueMap:
    """A measured surface."""

    heights: FloatArray  #: ``(rows, columns)`` metres.
    pitch: FloatArray  #: ``(2,)`` metres a pixel, along x and along y.


def read_tmd(path: Path) -> TrueMap:
    """Read a surface.

    Raises:
        DataRefused: not such a file, or of another length than it says.
    """
    data = path.read_bytes()
    end = data.find(b"\0", len(_MAGIC))
    if not data.startswith(_MAGIC) or end < 0 or len(data) < end + 1 + _COUNTS.itemsize:
        raise DataRefused(f"{path} is no TrueMap file of version 2.0 ({len(data)} bytes)")
    counts = np.frombuffer(data, _COUNTS, 1, end + 1)[0]
    columns, rows = int(counts["columns"]), int(counts["rows"])
    body = data[end + 1 + _COUNTS.itemsize :]
    if len(body) != 4 * rows * columns:
        raise DataRefused(
            f"{path} says {rows} x {columns} heights and holds {len(body) / 4:g}; fetch it again"
        )
    heights = np.frombuffer(body, "<f4").reshape(rows, columns).astype(np.float64) * 1e-3
    lengths = counts["length"].astype(np.float64) * 1e-3
    return TrueMap(read_only(heights), read_only(lengths / np.array([columns, rows])))
