"""Memory and work of a graph, known from its shapes before anything of it is computed.

onnxruntime computes what depends on constants alone as it loads a graph, and keeps it; everything else is
computed for every call. Both are bounded here: a file of a few kilobytes can describe any amount of either.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from math import prod
from typing import NamedTuple

from onnx import GraphProto, ModelProto, NodeProto, helper, shape_inference

from harness.basics.errors import DataRefused

MAX_VALUE = 2**24
"""Numbers of one value that a graph computes for one query."""

MAX_CONSTANT_BYTES = 2**29
"""Bytes of all values that depend on constants alone; float16 weights of the largest file become 2^29."""

MAX_CONSTANT_WORK = 2**30
"""Operations to compute them: conversions of weights, some 4 per number."""

MAX_LIVE_BYTES = 2**28
"""Bytes of the values that one query needs at the same time."""

MAX_WORK = 2**34
"""Multiplications and other operations of one query; a published completion network has 2^33.7."""

MAX_CALL_BYTES = 2**29
"""Bytes of the values that one call, of many queries, needs at the same time."""

MAX_CALL_WORK = 2**38
"""Multiplications and other operations of one call."""

_ELEMENTWISE_WORK = 4
"""Operations per number of a result that is no product: an exponential takes several multiplications."""

_CHECKED_ROWS = tuple(4**k for k in range(1, 11))
"""Numbers of queries at which a value must be at most so many times as large as for one query."""

_SHAPE_NUMBERS = 1024
"""Constants up to this size may be shapes, and are kept for shape inference; weights are left out."""

_AGAIN = "build the object again, or get it from where it was built"


class _Value(NamedTuple):
    """The shape of a value and the bytes of one of its numbers."""

    shape: tuple[int, ...]
    item_bytes: int

    @property
    def numbers(self) -> int:
        return prod(self.shape)


_Values = Mapping[str, _Value]


@dataclass(frozen=True)
class GraphCost:
    """Memory and work of one query."""

    live_bytes: int
    """Peak, over the order of the operations, of the values that a query needs at the same time."""

    work: int
    """Multiplications and other operations."""

    def require_call(self, rows: int, name: str) -> None:
        """Refuse a call of so many queries that takes too much memory or work.

        Raises:
            DataRefused: naming the file, the need and the limit.
        """
        if rows * self.live_bytes > MAX_CALL_BYTES:
            raise DataRefused(
                f"{name}: {rows} queries at once need {rows * self.live_bytes / 2**20:,.0f} MiB, at most "
                f"{MAX_CALL_BYTES / 2**20:.0f} MiB may be; ask for fewer at once, or {_AGAIN}"
            )
        if rows * self.work > MAX_CALL_WORK:
            raise DataRefused(
                f"{name}: {rows} queries at once take {rows * self.work:.2g} operations, at most "
                f"{MAX_CALL_WORK:.2g} may be; ask for fewer at once, or {_AGAIN}"
            )


def require_bounded(model: ModelProto, name: str) -> None:
    """Refuse a valid graph, its inputs free in their first size alone, that takes too much memory or work.

    Args:
        model: a graph that passed onnx's own checker.
        name: name of its file, for messages.

    Raises:
        DataRefused: a value whose size is unknown, too large, or grows faster than the number of queries;
            or too much memory or work, for constants or for one query.
    """
    _require_bounded_skeleton(_without_weights(model).SerializeToString(deterministic=True), name)


def query_cost(model: ModelProto, name: str) -> GraphCost:
    """Compute the cost of one query of a graph that ``require_bounded`` accepted."""
    return _skeleton_cost(_without_weights(model).SerializeToString(deterministic=True), name)


# Cached: a process opens the same network repeatedly, and its shapes are inferred at eleven sizes.
@lru_cache(maxsize=32)
def _require_bounded_skeleton(data: bytes, name: str) -> None:
    skeleton = ModelProto.FromString(data)
    single = _values(skeleton, 1, name)
    for rows in _CHECKED_ROWS:
        for value, many in _values(skeleton, rows, name).items():
            if many.numbers > rows * single[value].numbers:
                raise DataRefused(
                    f"{name}: {value!r} has {single[value].numbers} numbers for one query and {many.numbers} "
                    f"for {rows}; a network's values grow no faster than the number of queries; {_AGAIN}"
                )
    _counted(skeleton.graph, single, name)


@lru_cache(maxsize=32)
def _skeleton_cost(data: bytes, name: str) -> GraphCost:
    skeleton = ModelProto.FromString(data)
    return _counted(skeleton.graph, _values(skeleton, 1, name), name)


def _counted(graph: GraphProto, values: _Values, name: str) -> GraphCost:
    # Names of the values that do not depend on a query.
    constants = {tensor.name for tensor in graph.initializer} - {value.name for value in graph.input} | {""}
    for node in graph.node:
        if all(value in constants for value in node.input):
            constants.update(node.output)
    last_use = {value: index for index, node in enumerate(graph.node) for value in node.input}
    outputs = {value.name for value in graph.output}
    constant_bytes = constant_work = live = peak = work = 0
    for index, node in enumerate(graph.node):
        made = [value for value in node.output if value]
        needed, own_work = sum(_bytes_of(values[value]) for value in made), _work_of(node, values)
        if constants.issuperset(made):
            constant_bytes, constant_work = constant_bytes + needed, constant_work + own_work
            continue
        live, work = live + needed, work + own_work
        peak = max(peak, live + _workspace_of(node, values))
        done = (value for value in {*node.input, *made} if last_use.get(value, index) == index)
        live -= sum(_bytes_of(values[value]) for value in done if value not in constants | outputs)
    for need, limit, unit, subject in (
        (constant_bytes, MAX_CONSTANT_BYTES, "bytes", "its constants alone take"),
        (constant_work, MAX_CONSTANT_WORK, "operations", "its constants alone take"),
        (peak, MAX_LIVE_BYTES, "bytes at the same time", "one query takes"),
        (work, MAX_WORK, "operations", "one query takes"),
    ):
        if need > limit:
            raise DataRefused(f"{name}: {subject} {need:.3g} {unit}, at most {limit:.3g} may be; {_AGAIN}")
    return GraphCost(peak, work)


def _bytes_of(value: _Value) -> int:
    return value.numbers * value.item_bytes


def _work_of(node: NodeProto, values: _Values) -> int:
    """Multiplications of a product; a few operations per number, taken in or given, of everything else."""
    result = sum(values[value].numbers for value in node.output if value)
    shapes = [values[value].shape if value else () for value in node.input]
    match node.op_type:
        case "MatMul":
            return result * shapes[0][-1]
        case "Gemm":
            turned = any(item.name == "transA" and item.i for item in node.attribute)
            return result * shapes[0][0 if turned else 1]
        case "Conv":
            return result * prod(shapes[1][1:])
        case "MaxPool":
            return result * max(
                1, *(prod(item.ints) for item in node.attribute if item.name == "kernel_shape")
            )
        case (
            "GRU"
        ):  # (steps, rows, in), weights (directions, 3 hidden, in) and (directions, 3 hidden, hidden)
            return shapes[0][0] * shapes[0][1] * (prod(shapes[1]) + prod(shapes[2]))
        case _:
            return _ELEMENTWISE_WORK * max(result, *(prod(shape) for shape in shapes), 0)


def _workspace_of(node: NodeProto, values: _Values) -> int:
    """Bytes that onnxruntime needs beside a node's values: patches of a convolution, gates of a GRU."""
    if node.op_type == "Conv":
        result, kernel = values[node.output[0]].shape, values[node.input[1]].shape
        return 4 * prod(result[2:]) * prod(kernel[1:])
    if node.op_type == "GRU":
        steps, rows = values[node.input[0]].shape[:2]
        return 4 * steps * rows * prod(values[node.input[1]].shape[:2])
    return 0


def _without_weights(model: ModelProto) -> ModelProto:
    """A copy for shape inference: without large constants' numbers, and without claims about results."""
    skeleton = ModelProto()
    skeleton.CopyFrom(model)
    for tensor in skeleton.graph.initializer:
        if prod(tensor.dims) > _SHAPE_NUMBERS:
            for field in ("raw_data", "float_data", "double_data", "int32_data", "int64_data"):
                tensor.ClearField(field)
    del skeleton.graph.value_info[:]
    for value in skeleton.graph.output:  # what a file claims of its results is not what they are
        value.type.tensor_type.ClearField("shape")
    return skeleton


def _values(skeleton: ModelProto, rows: int, name: str) -> dict[str, _Value]:
    """Every value of a graph for so many queries."""
    sized = ModelProto()
    sized.CopyFrom(skeleton)
    for value in sized.graph.input:
        for size in value.type.tensor_type.shape.dim:
            if not size.HasField("dim_value"):
                size.dim_value = rows
    shaped = shape_inference.infer_shapes(sized, strict_mode=True, data_prop=True).graph
    found = {
        tensor.name: _Value(tuple(tensor.dims), _item_bytes(tensor.data_type))
        for tensor in shaped.initializer
    }
    for value in (*shaped.input, *shaped.value_info, *shaped.output):
        tensor = value.type.tensor_type
        if tensor.HasField("shape") and all(size.HasField("dim_value") for size in tensor.shape.dim):
            shape = tuple(size.dim_value for size in tensor.shape.dim)
            found[value.name] = _Value(shape, _item_bytes(tensor.elem_type))
    for output in (output for node in shaped.node for output in node.output if output):
        if output not in found:
            raise DataRefused(f"{name}: how large {output!r} becomes is not known before it runs; {_AGAIN}")
        if min(found[output].shape, default=0) < 0:
            raise DataRefused(f"{name}: {output!r} has the shape {found[output].shape}; {_AGAIN}")
        if rows == 1 and found[output].numbers > MAX_VALUE:
            raise DataRefused(
                f"{name}: one query computes {found[output].numbers:.3g} numbers {output!r}, more than "
                f"{MAX_VALUE}; {_AGAIN}"
            )
    return found


def _item_bytes(element_type: int) -> int:
    return helper.tensor_dtype_to_np_dtype(element_type).itemsize
