"""Query the networks of an imported object, and refuse what they were not trained at."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.errors import DataRefused, OutOfDomain, WrongUse
from harness.objectfile.runtime import Network

_BATCH = 16384
"""Rows in one run of a network."""

FLOAT32_SLACK = 1e-6
"""Slack relative to a range: the bounds of a published file are often float32."""


def query(network: Network, inputs: Mapping[str, AnyArray], rows: int = _BATCH) -> dict[str, FloatArray]:
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
    outputs = {}
    for tensor in network.outputs:
        values = np.concatenate([run[tensor.name] for run in runs]).astype(np.float64)
        if not np.isfinite(values).all():
            raise DataRefused(
                f"{network.name} gives {tensor.name} that are not finite; import the file again"
            )
        outputs[tensor.name] = values
    return outputs


def require_trained(
    values: FloatArray, low: Any, high: Any, what: str, unit: str, slack: float = FLOAT32_SLACK
) -> None:
    """Refuse queries outside of the range that a network was trained in.

    Args:
        values: ``(n, k)`` numbers of the queries.
        low: least numbers, ``(k,)`` or one for all.
        high: greatest numbers, ``(k,)`` or one for all.
        what: noun for a query in the message.
        unit: unit of the numbers.
        slack: fraction of the range by which a query may exceed it.

    Raises:
        OutOfDomain: naming the first query outside.
    """
    low, high = (np.broadcast_to(np.asarray(bound, np.float64), values.shape[1:]) for bound in (low, high))
    margin = slack * (high - low)
    outside = np.flatnonzero(((values < low - margin) | (values > high + margin)).any(axis=1))
    if len(outside):
        number, least, greatest = (
            ", ".join(f"{value:.6g}" for value in row) for row in (values[outside[0]], low, high)
        )
        raise OutOfDomain(
            f"{what} {outside[0]} at ({number}) {unit} is outside of the box from ({least}) to ({greatest}) "
            f"{unit} that the network was trained in ({len(outside)} of {len(values)} are); move it inside"
        )


def coordinate_bounds(
    given: tuple[float, float] | None,
    queried: FloatArray,
    *,
    of_query: bool,
    option: str,
    what: str,
    unit: str,
    slack: float = FLOAT32_SLACK,
) -> tuple[float, float]:
    """Return the least and greatest coordinate that a network of version 1.0 normalises its queries by.

    The files of version 1.0 hold neither. Its program takes them from the query itself, so that the answer
    for one point depends on the other points of the query.

    Args:
        given: bounds that were given at the import; None if there are none.
        queried: ``(n, 3)`` points of the query.
        of_query: whether to take the query's own, as the published program does.
        option: option of the import that takes the bounds.
        what: noun for a point in messages.
        unit: unit of the coordinates.
        slack: fraction of the range by which a point may exceed it.

    Raises:
        WrongUse: no bounds were given.
        OutOfDomain: a point outside of the bounds.
    """
    if of_query:
        return float(queried.min()), float(queried.max())
    if given is None:
        raise WrongUse(
            "the object was imported without the bounds of its coordinates, which ObjectFolder 1.0 does not "
            f"publish: import the file again with {option} LOW HIGH in {unit}, or say --objectfolder-compat "
            "to take the query's own, as its program does"
        )
    require_trained(queried, *given, what, unit, slack)
    return given
