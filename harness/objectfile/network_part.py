"""Writing a network of an ObjectFile: its graph as a file, what is said of it, its self-test."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from onnx import ModelProto

from harness.basics.arrays import AnyArray, IntArray
from harness.objectfile.entries import Input, NetworkEntry, Sampled, SelfTest, Tensor, Whole
from harness.objectfile.file import file_entry
from harness.objectfile.runtime import Network

SELF_TEST_VALUES = 512
"""Of an output that are kept, at most, but for what a part keeps beside."""


def spread(found: AnyArray) -> IntArray:
    """Places of a flat output, from its first number to its last, evenly."""
    count = min(SELF_TEST_VALUES, found.size)
    return np.unique(np.linspace(0, found.size - 1, count).astype(np.int64))


@dataclass(frozen=True, eq=False)
class NetworkPart:
    """A network to be written."""

    file: str  #: its name in the folder.
    graph: ModelProto  #: of the network.
    inputs: tuple[Input, ...]  #: it takes.
    outputs: tuple[Tensor, ...]  #: it gives.
    asked: Mapping[str, AnyArray]  #: the inputs of its self-test, by name.
    tolerance: float  #: of the self-test, of the greatest number of each output.
    measured: Mapping[str, float] = field(default_factory=dict)  #: its errors, by a name with its unit.
    kept: Callable[[AnyArray], IntArray] = spread  #: the places of a flat output that the self-test keeps.


def network_entry(part: NetworkPart, contents: dict[str, bytes]) -> NetworkEntry:
    """The entry of a network, whose bytes are put among the contents of its folder.

    Raises:
        DataRefused: a graph that must not be run, or that takes or gives something else.
    """
    data = part.graph.SerializeToString(deterministic=True)
    network = Network(data, part.file, part.inputs, part.outputs)
    contents[part.file] = data
    return NetworkEntry(
        **file_entry(part.file, data).model_dump(),
        inputs=part.inputs,
        outputs=part.outputs,
        self_test=_self_test(network, part),
        measured=dict(part.measured),
    )


def _self_test(network: Network, part: NetworkPart) -> SelfTest:
    found = network(part.asked)
    outputs = []
    for tensor in part.outputs:
        values = found[tensor.name].ravel()
        at = part.kept(values)
        outputs.append(Sampled(name=tensor.name, at=tuple(at.tolist()), values=tuple(values[at].tolist())))
    return SelfTest(
        rows=len(next(iter(part.asked.values()))),
        inputs=tuple(
            Whole(name=key, values=tuple(values.ravel().tolist())) for key, values in part.asked.items()
        ),
        outputs=tuple(outputs),
        tolerance=part.tolerance,
    )
