"""Query the networks of an imported ObjectFile, in batches."""

from collections.abc import Mapping

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.errors import DataRefused, OutOfDomain
from harness.objectfile.runtime import Network

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
