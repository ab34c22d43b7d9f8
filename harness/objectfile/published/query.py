"""Read ObjectFolder's own query files, and query the networks of an imported ObjectFile.

The files are rows of numbers in ``.npy``, checked before anything is computed. ``vision``: camera and light,
``(n, 6)`` in the vision frame. ``audio``: vertices ``(n, 3)`` in metres and forces ``(n, 3)``. ``touch``:
vertices ``(n, 3)`` in metres, and the gel's tilt and azimuth in rad and depth in metres, ``(n, 3)``.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray, read_only
from harness.basics.errors import DataRefused, OutOfDomain
from harness.basics.files.foreign_file import require_readable
from harness.basics.files.named_file import require_file
from harness.basics.npz_file import read_array
from harness.objectfile.runtime import Network

MOST_ROWS = 1000
"""Of one file: a thousand compatible sounds are 1 GB while they are computed."""

_MOST_BYTES = 64 * 2**20

_AT_ONCE = 16384
"""Rows in one run of a network."""

_ROUNDING = 1e-6
"""Slack relative to an extent: bounds of a published file are often float32."""


def query(network: Network, inputs: Mapping[str, AnyArray], rows: int = _AT_ONCE) -> dict[str, FloatArray]:
    """Compute the outputs of a network.

    Args:
        network: network of an imported object.
        inputs: arrays of one row a query, by the names of the network's inputs; converted to its types.
        rows: queries in one run.

    Returns:
        Outputs by name, float64.

    Raises:
        DataRefused: an output is not finite.
    """
    taken = {item.name: np.ascontiguousarray(inputs[item.name], item.dtype) for item in network.inputs}
    count = len(next(iter(taken.values())))
    runs = [
        network({name: array[first : first + rows] for name, array in taken.items()})
        for first in range(0, max(count, 1), rows)
    ]
    outputs = {
        tensor.name: np.concatenate([run[tensor.name] for run in runs]).astype(np.float64)
        for tensor in network.outputs
    }
    for name, values in outputs.items():
        if not np.isfinite(values).all():
            raise DataRefused(f"{network.name} gives {name} that are not finite; import the file again")
    return outputs


def require_in_box(points: FloatArray, low: FloatArray, high: FloatArray, what: str) -> None:
    """Refuse points that a network was not trained at.

    Args:
        points: ``(n, 3)`` m.
        low: ``(3,)`` m, least corner of the box.
        high: ``(3,)`` m, greatest corner of the box.
        what: noun for a point in the message.

    Raises:
        OutOfDomain: naming the first point outside.
    """
    slack = _ROUNDING * (high - low)
    outside = np.flatnonzero(((points < low - slack) | (points > high + slack)).any(axis=1))
    if len(outside):
        x, y, z = points[outside[0]]
        corners = ["(" + ", ".join(f"{value:.6g}" for value in corner) + ")" for corner in (low, high)]
        raise OutOfDomain(
            f"{what} {outside[0]} at ({x:.6g}, {y:.6g}, {z:.6g}) m is outside of the box from {corners[0]} "
            f"to {corners[1]} m that the network was trained in ({len(outside)} of {len(points)} are); give "
            "vertices of the object's own mesh"
        )


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
