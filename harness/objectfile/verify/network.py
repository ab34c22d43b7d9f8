"""Whether a network computes what it did when it was made, and finite numbers all over its domain."""

from collections.abc import Callable, Mapping

import numpy as np

from harness.basics.arrays import AnyArray
from harness.basics.errors import DataRefused
from harness.objectfile.entries import Input, NetworkEntry, SelfTest, Tensor
from harness.objectfile.file import ObjectFile
from harness.objectfile.published.entries import PublishedObject
from harness.objectfile.runtime import Network
from harness.objectfile.self_test import require_self_test
from harness.objectfile.surface_search import SurfaceSearch

_INSIDE = 256
"""Random queries within the domain, and as many at its very edge."""

_AT_ONCE = 16
"""Queries in one run: an image for each is large within a graph."""

Opened = Callable[[], Network]


def opened_once(of: ObjectFile | PublishedObject, entry: NetworkEntry) -> Opened:
    """The network, opened by the first check that asks for it."""
    opened: list[Network] = []

    def run() -> Network:
        if not opened:
            opened.append(Network(of.read(entry), entry.file, entry.inputs, entry.outputs))
        return opened[0]

    return run


def look_at_graph(run: Opened) -> str:
    """Open it, which looks through it.

    Raises:
        DataRefused: as ``Network``.
    """
    run()
    return "valid ONNX of known operations, weights inside and finite, inputs and outputs as described"


def look_at_domain(of: ObjectFile | PublishedObject, run: Opened) -> str:
    """Ask all over the domain it claims.

    Raises:
        DataRefused: a number is not finite, or an output has another shape than described.
    """
    network, random = run(), np.random.default_rng(0)
    queries = {item.name: _queries(of, item, random) for item in network.inputs}
    for first in range(0, 2 * _INSIDE, _AT_ONCE):
        _look_at_answers(network, {name: rows[first : first + _AT_ONCE] for name, rows in queries.items()})
    return f"finite at {2 * _INSIDE} places of the domain, half of them at its edge"


def _look_at_answers(network: Network, queries: Mapping[str, AnyArray]) -> None:
    outputs = network(queries)
    for tensor in network.outputs:
        values, wanted = outputs[tensor.name], _shape(tensor, _AT_ONCE)
        if values.shape != wanted:
            raise DataRefused(
                f"{network.name} gives {tensor.name!r} of shape {values.shape} where object.json "
                f"says {wanted}; build the object again"
            )
        bad = int(np.count_nonzero(~np.isfinite(values)))
        if bad:
            raise DataRefused(
                f"{network.name} gives {bad} of {values.size} numbers {tensor.name!r} that are not finite "
                "within the domain it claims; train it again, or claim less"
            )


def look_at_self_test(run: Opened, test: SelfTest) -> str:
    """Ask what was asked when it was made.

    Raises:
        DataRefused: the answer differs by more than the tolerance, or the test is none.
    """
    worst = require_self_test(run(), test)
    return f"as when it was made, to {worst:.1e} of the greatest number ({test.tolerance:g} is allowed)"


def _queries(of: ObjectFile | PublishedObject, item: Input, random: np.random.Generator) -> AnyArray:
    """``2 _INSIDE`` queries of one input, half inside of its domain, half at the edge."""
    domain, count = item.domain, 2 * _INSIDE
    shares = random.random((count, int(np.prod(_shape(item, 1)))))
    shares[_INSIDE:] = np.round(shares[_INSIDE:])
    if domain.near_surface_m is not None:
        if isinstance(of, PublishedObject):
            raise DataRefused(
                f"the domain of {item.name!r} is near a surface, which an import does not have; import it "
                "again"
            )
        places, normals = SurfaceSearch(of.mesh).spread(count)
        lifts = domain.near_surface_m * (2.0 * shares[:, :1] - 1.0)
        return np.asarray((places + lifts * normals).astype(item.dtype))
    low, high = np.array(domain.low, np.float64), np.array(domain.high, np.float64)
    if low.size != shares.shape[1]:
        raise DataRefused(
            f"the domain of {item.name!r} has {low.size} numbers for queries of {shares.shape[1]}; build it "
            "again"
        )
    queries = low + shares * (high - low)
    return np.asarray(queries.reshape(_shape(item, count)).astype(item.dtype))


def _shape(tensor: Tensor, rows: int) -> tuple[int, ...]:
    return tuple(rows if size == "n" else size for size in tensor.shape)
