"""ObjectFolder's own query files: rows of numbers in ``.npy``, checked before anything is computed.

``vision``: camera and light, ``(n, 6)`` in the vision frame. ``audio``: vertices ``(n, 3)`` in metres and
forces ``(n, 3)``. ``touch``: vertices ``(n, 3)`` in metres, and the gel's tilt and azimuth in rad and depth
in metres, ``(n, 3)``.
"""

from pathlib import Path

import numpy as np

from harness.basics.arrays import FloatArray, read_only
from harness.basics.errors import DataRefused
from harness.basics.files.foreign_file import require_readable
from harness.basics.files.named_file import require_file
from harness.basics.npz_file import read_array

MOST_ROWS = 1000
"""Of one file: a thousand compatible sounds are 1 GB while they are computed."""

_MOST_BYTES = 64 * 2**20


def read_rows(path: Path, columns: int, what: str) -> FloatArray:
    """``(n, columns)`` float64 of a query file; nothing in it is run.

    Args:
        path: of the ``.npy`` file; one row may be written without its axis.
        columns: of a row.
        what: a row is, for a refusal: "vertices x y z, m".

    Raises:
        WrongUse: there is no such file.
        DataRefused: it holds something else, or numbers that are not finite.
    """
    require_file(path, "query file", "give a .npy file as ObjectFolder's")
    require_readable(path, "a query file", _MOST_BYTES)
    found = read_array(path, "queries")
    if found.ndim == 1 and found.size == columns:
        found = found[None]
    if found.dtype.kind not in "fiu" or found.ndim != 2 or found.shape[1] != columns:
        raise DataRefused(f"{path} holds {found.dtype} {found.shape}, not rows of {columns}: {what}")
    if not 1 <= len(found) <= MOST_ROWS:
        raise DataRefused(f"{path} has {len(found)} rows; give 1 to {MOST_ROWS}")
    rows = found.astype(np.float64)
    bad = np.flatnonzero(~np.isfinite(rows).all(axis=1))
    if len(bad):
        raise DataRefused(f"{path}: row {bad[0]} is {found[bad[0]].tolist()}, not finite; write it again")
    return read_only(rows)


def require_pairs(first: FloatArray, second: FloatArray, what: str) -> None:
    """Refuse two files of different numbers of rows; ``what`` names both."""
    if len(first) != len(second):
        raise DataRefused(f"{len(first)} and {len(second)} rows of {what}; give one of each for each query")
