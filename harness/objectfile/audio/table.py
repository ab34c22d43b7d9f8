"""The modes' shapes at the nodes of a surface, in half precision: the level that learns nothing.

A file of numpy (``.npy``, version 1.0), little-endian float16 ``(nodes, m, 3)``, each mode divided by
its greatest number, so that neither a grain nor an anvil leaves the range of float16. Error at a
node: 2^-11 of the number, or 3e-8 of the mode's greatest.
"""

import numpy as np
import numpy.typing as npt

from harness.basics.arrays import AnyArray, FloatArray, IntArray, read_only
from harness.basics.errors import DataRefused
from harness.objectfile.npy_file import npy_array

HalfArray = npt.NDArray[np.float16]


def scaled(shapes: FloatArray) -> tuple[HalfArray, FloatArray]:
    """``(n, m, 3)`` shapes as a table, and the ``(m,)`` scales of its modes; one for a mode at rest."""
    greatest = np.abs(shapes).max(axis=(0, 2))
    scales = np.where(greatest > 0.0, greatest, 1.0)
    return (shapes / scales[:, None]).astype("<f2"), scales


def table_from(data: bytes, name: str, shape: tuple[int, int, int]) -> HalfArray:
    """The table in a file's bytes; nothing is unpickled, and no more memory taken than the file has.

    Raises:
        DataRefused: it is no such file, has another type or shape, or numbers that are not finite.
    """
    table: HalfArray = npy_array(data, name, "<f2", shape, f"a table of float16 {shape}")
    if not np.isfinite(table).all():
        bad = int(np.count_nonzero(~np.isfinite(table)))
        raise DataRefused(f"{name} has {bad} numbers that are not finite; build the object again")
    return read_only(table)


def interpolated(table: HalfArray, scales: FloatArray, nodes: IntArray, shares: FloatArray) -> FloatArray:
    """``(n, m, 3)`` 1/sqrt(kg): shares of the shapes at three nodes for each of n places.

    Args:
        table: ``(nodes, m, 3)``.
        scales: ``(m,)`` 1/sqrt(kg).
        nodes: ``(n, 3)`` of the table.
        shares: ``(n, 3)`` that add up to one.
    """
    total: AnyArray = np.zeros((len(nodes), *table.shape[1:]), np.float32)
    for corner in range(3):
        total += table[nodes[:, corner]].astype(np.float32) * shares[:, corner, None, None].astype(np.float32)
    result: FloatArray = total * scales[:, None]
    return result
