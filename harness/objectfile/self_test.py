"""Whether a network answers as it did when it was made: another's does not, whatever its hash."""

import numpy as np

from harness.basics.arrays import AnyArray
from harness.basics.errors import DataRefused
from harness.objectfile.entries import NetworkEntry, Sampled, SelfTest, Tensor, Whole
from harness.objectfile.runtime import Network


def open_network(data: bytes, entry: NetworkEntry, threads: int = 1, only: tuple[str, ...] = ()) -> Network:
    """Open the network of an entry from its file's bytes and run its self-test; see ``Network``.

    Raises:
        DataRefused: as ``Network``; or the outputs differ from those at build time.
    """
    network = Network(data, entry.file, entry.inputs, entry.outputs, threads, only)
    require_self_test(network, entry.self_test)
    return network


def require_self_test(network: Network, test: SelfTest) -> float:
    """Return the largest difference from the outputs at build time, relative to the largest output.

    Raises:
        DataRefused: the difference exceeds the tolerance, or the test is empty.
    """
    named = zip(network.inputs, test.inputs, strict=True)
    queries = {item.name: queries_of(item, values, test.rows) for item, values in named}
    outputs = network(queries)
    worst = max(_gap(outputs[kept.name].ravel(), kept) for kept in test.outputs if kept.name in outputs)
    if not worst <= test.tolerance:
        raise DataRefused(
            f"the outputs of {network.name} differ from those at build time by {worst:.2g} of the largest; "
            f"{test.tolerance:g} is allowed: another onnxruntime with other results, or another object's "
            "network; build the object again"
        )
    return worst


def queries_of(item: Tensor, kept: Whole, rows: int) -> AnyArray:
    """The queries of a self-test, as an input takes them.

    Raises:
        DataRefused: they are of another number.
    """
    shape = tuple(rows if size == "n" else size for size in item.shape)
    if len(kept.values) != int(np.prod(shape)):
        raise DataRefused(
            f"the self-test gives {len(kept.values)} numbers {kept.name!r} where {rows} queries are {shape}; "
            "build it again"
        )
    return np.array(kept.values, dtype=item.dtype).reshape(shape)


def _gap(found: AnyArray, kept: Sampled) -> float:
    if max(kept.at) >= found.size:
        raise DataRefused(
            f"the self-test knows number {max(kept.at)} of {kept.name!r}, which has {found.size}; "
            "build it again"
        )
    chosen, values = found[list(kept.at)].astype(np.float64), np.array(kept.values)
    if not np.isfinite(chosen).all():
        raise DataRefused(
            f"{kept.name!r} is not finite where it was when it was made; build the object again"
        )
    scale = float(np.abs(values).max()) or 1.0
    return float(np.abs(chosen - values).max()) / scale
