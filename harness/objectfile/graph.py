"""Building blocks of the networks as graphs, from plain arrays; training is somewhere else.

The same arrays give the same bytes: nothing here depends on time, place or the order of a hash.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from onnx import ModelProto, NodeProto, TensorProto, ValueInfoProto, helper, numpy_helper

from harness.basics.arrays import AnyArray, FloatArray, IntArray
from harness.basics.errors import WrongUse

IR_VERSION = 8
OPSET = 17
"""Both of 2022: whatever reads ONNX today reads these."""

Storage = Literal["float32", "float16"]


@dataclass(frozen=True, eq=False)
class MlpWeights:
    """A multilayer perceptron on an encoded input: ReLU after every layer but the last."""

    layers: Sequence[tuple[AnyArray, AnyArray]]
    """``(weight, bias)`` of each, ``(in, out)`` and ``(out,)``: ``y = x @ weight + bias``. The transposes of
    what torch's ``Linear.weight`` holds."""
    skips: tuple[int, ...] = ()
    """layers, counted from 0, that take the encoded input in front of what the layer before gave:
    ``[encoding, hidden]``. The network of ObjectFolder 2.0 has ``(5,)``."""

    @property
    def outputs(self) -> int:
        """Numbers that come out."""
        return int(self.layers[-1][0].shape[1])

    def scaled(self, factor: AnyArray | float, offset: AnyArray | float = 0.0) -> "MlpWeights":
        """The same, whose outputs are ``output * factor + offset``, folded into the last layer in float64."""
        *inner, (weight, bias) = self.layers
        last = np.asarray(weight, np.float64) * factor, np.asarray(bias, np.float64) * factor + offset
        return MlpWeights((*inner, last), self.skips)


@dataclass(frozen=True)
class Encoding:
    """The input beside sines and cosines of it (Mildenhall et al., NeRF, ECCV 2020, section 5.1).

    ``[v, sin(f0 v), cos(f0 v), sin(f1 v), cos(f1 v), ...]``, each block the whole vector: the order
    in which the first layer's rows (and a skip layer's) are counted.
    """

    frequencies: tuple[float, ...]  #: rad for a unit of the normalised input; empty for the input alone.

    @classmethod
    def octaves(cls, count: int, first: float = 1.0) -> "Encoding":
        """``first, 2 first, 4 first, ...``; ObjectFolder 2.0 has ten octaves from 1, without pi."""
        return cls(tuple(first * 2.0**k for k in range(count)))

    def width(self, inputs: int) -> int:
        """Numbers that an input of that many becomes."""
        return inputs * (1 + 2 * len(self.frequencies))


@dataclass(frozen=True, eq=False)
class Normaliser:
    """``(input - shift) * factor``, in float64, before anything is encoded."""

    shift: FloatArray  #: ``(d,)`` in the input's unit.
    factor: FloatArray  #: ``(d,)`` in one over it.

    @classmethod
    def unit_box(cls, low: FloatArray, high: FloatArray) -> "Normaliser":
        """From ``low .. high`` to ``0 .. 1``, each axis by itself, as ObjectFolder 2.0 does.

        Raises:
            WrongUse: a box without extent along an axis.
        """
        low, high = np.asarray(low, np.float64), np.asarray(high, np.float64)
        if not (np.isfinite(low).all() and np.isfinite(high).all() and (high > low).all()):
            raise WrongUse(f"a box from {low} to {high} has no extent along some axis; say where inputs lie")
        return cls(low, 1.0 / (high - low))


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

    def normalised(self, value: str, normaliser: Normaliser) -> str:
        """A float64 input as normalised float32."""
        moved = self.add("Sub", value, self.constant(np.asarray(normaliser.shift, np.float64)))
        scaled = self.add("Mul", moved, self.constant(np.asarray(normaliser.factor, np.float64)))
        return self.add("Cast", scaled, to=TensorProto.FLOAT)

    def encoded(self, value: str, inputs: int, encoding: Encoding) -> str:
        """``[v, sin, cos]`` with all sines before all cosines; ``encoded_rows`` says which is which."""
        if not encoding.frequencies:
            return value
        spread = np.kron(np.array(encoding.frequencies)[None, :], np.eye(inputs)).astype(np.float32)
        angles = self.add("MatMul", value, self.constant(spread))
        return self.add("Concat", value, self.add("Sin", angles), self.add("Cos", angles), axis=1)

    def mlp(self, encoded: str, weights: MlpWeights, rows: IntArray, what: str) -> str:
        """The perceptron on an encoded input whose rows are in the order ``rows``."""
        hidden = encoded
        for index, (weight, bias) in enumerate(weights.layers):
            matrix = np.asarray(weight)
            if index == 0 or index in weights.skips:
                matrix = np.concatenate([matrix[rows], matrix[len(rows) :]])
            if index in weights.skips:
                hidden = self.add("Concat", encoded, hidden, axis=1)
            named = f"layer {index} of {what}"
            hidden = self.add("Gemm", hidden, self.weight(matrix, named), self.weight(bias, named))
            if index < len(weights.layers) - 1:
                hidden = self.add("Relu", hidden)
        return hidden

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


def encoded_rows(inputs: int, encoding: Encoding) -> IntArray:
    """Which number of ``Encoding``'s order is at each place of ``Nodes.encoded``'s."""
    octave = np.arange(len(encoding.frequencies))[:, None] * 2 * inputs + inputs + np.arange(inputs)
    return np.concatenate([np.arange(inputs), octave.ravel(), octave.ravel() + inputs])


def check_mlp(weights: MlpWeights, encoded: int, what: str) -> None:
    """Refuse layers that do not fit together.

    Args:
        weights: looked at.
        encoded: numbers of the encoded input.
        what: the network is called in messages.

    Raises:
        WrongUse: it names the layer, its shape and the shape that fits.
    """
    if not weights.layers or not all(0 < skip < len(weights.layers) for skip in weights.skips):
        raise WrongUse(
            f"{what} has {len(weights.layers)} layers and skips {weights.skips}; skips count from 1"
        )
    width = 0
    for index, (weight, bias) in enumerate(weights.layers):
        wanted = width + (encoded if index == 0 or index in weights.skips else 0)
        if weight.ndim != 2 or weight.shape[0] != wanted or bias.shape != weight.shape[1:]:
            raise WrongUse(
                f"layer {index} of {what} has weight {weight.shape} and bias {bias.shape}; it takes "
                f"({wanted}, out) and (out,); torch's Linear.weight is to be transposed"
            )
        width = weight.shape[1]
