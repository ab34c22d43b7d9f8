"""Building blocks of the networks as graphs, from plain arrays; training is somewhere else.

The same arrays give the same bytes: nothing here depends on time, place or the order of a hash.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from onnx import ModelProto, NodeProto, TensorProto, ValueInfoProto, helper, numpy_helper

from harness.basics.arrays import AnyArray
from harness.basics.errors import WrongUse

IR_VERSION = 8
OPSET = 17
"""Both of 2022: whatever reads ONNX today reads these."""

Storage = Literal["float32", "float16"]


@dataclass
class Nodes:
    """A graph under construction; every method adds to it and gives the new value's name."""

    storage: Storage = "float32"
    nodes: list[NodeProto] = field(default_factory=list)
    constants: list[TensorProto] = field(default_factory=list)

    def add(self, operation: str, *inputs: str, name: str = "", **attributes: Any) -> str:
        """One operation with one result."""
        output = name or f"v{len(self.nodes)}"
        self.nodes.append(helper.make_node(operation, list(inputs), [output], **attributes))
        return output

    def constant(self, array: AnyArray) -> str:
        """An array as it is."""
        name = f"c{len(self.constants)}"
        self.constants.append(numpy_helper.from_array(np.ascontiguousarray(array), name))
        return name

    def weight(self, array: AnyArray, what: str) -> str:
        """An array as float32, held in the graph's storage type; numbers too small for it are zero.

        Raises:
            WrongUse: a number that is not finite, or that the storage cannot hold.
        """
        with np.errstate(over="ignore", under="ignore"):  # said below, or meant
            stored = np.asarray(array, np.float64).astype(self.storage)
        if not np.isfinite(stored).all():
            bad = int(np.count_nonzero(~np.isfinite(stored)))
            raise WrongUse(
                f"{what} has {bad} numbers that are not finite in {self.storage}; train again, "
                "or store it as float32"
            )
        # Subnormal weights are noise, and slow every product they enter.
        stored[np.abs(stored) < np.finfo(stored.dtype).smallest_normal] = 0.0
        name = self.constant(stored)
        return name if self.storage == "float32" else self.add("Cast", name, to=TensorProto.FLOAT)

    def model(
        self, name: str, inputs: Sequence[ValueInfoProto], outputs: Sequence[ValueInfoProto], doc: str
    ) -> ModelProto:
        """The finished graph."""
        graph = helper.make_graph(self.nodes, name, inputs, outputs, self.constants)
        operators = [helper.make_opsetid("", OPSET)]
        return helper.make_model(
            graph, ir_version=IR_VERSION, opset_imports=operators, producer_name="touchstone", doc_string=doc
        )


def float_value(name: str, shape: Sequence[int | str]) -> ValueInfoProto:
    """An input or an output of float32 numbers; a size in letters is that of queries."""
    return helper.make_tensor_value_info(name, TensorProto.FLOAT, list(shape))
