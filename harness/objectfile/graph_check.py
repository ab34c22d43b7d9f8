"""Check a graph from a file before it is run; the check runs nothing of it.

Refused are numbers kept in other files, operations that are not listed (so no loops and no code of others),
weights that are not finite, and values whose size is unknown. ``graph_cost`` bounds memory and work.
"""

import math
from collections.abc import Sequence

import numpy as np
import onnx
from google.protobuf.message import DecodeError
from onnx import ModelProto, TensorProto, helper, numpy_helper

from harness.basics.errors import DataRefused
from harness.objectfile.entries import Tensor
from harness.objectfile.graph_cost import require_bounded

MAX_INPUT = 2**16
"""Numbers of one input of one query."""

OPERATIONS = frozenset({
    "Abs", "Add", "And", "Cast", "Ceil", "Clip", "Concat", "Constant", "Conv", "Cos", "Div", "Elu",
    "Equal", "Exp", "Expand", "Flatten", "Floor", "GRU", "Gather", "GatherElements", "GatherND", "Gemm",
    "Greater", "GreaterOrEqual", "GridSample", "Identity", "LeakyRelu", "Less", "LessOrEqual", "Log",
    "MatMul", "Max", "MaxPool", "Min", "Mul", "Neg", "Not", "Or", "Pow", "ReduceMax", "ReduceMean",
    "ReduceMin", "ReduceSum", "Relu", "Reshape", "Shape", "Sigmoid", "Sin", "Slice", "Softmax", "Softplus",
    "Split", "Sqrt", "Squeeze", "Sub", "Tanh", "Transpose", "Unsqueeze", "Where",
})  # fmt: skip
_KINDS = (
    *(TensorProto.FLOAT, TensorProto.DOUBLE, TensorProto.FLOAT16),
    *(TensorProto.INT32, TensorProto.INT64, TensorProto.UINT8, TensorProto.INT8, TensorProto.BOOL),
)
_AGAIN = "build the object again, or get it from where it was built"


def checked_graph(data: bytes, name: str) -> ModelProto:
    """Read and check the graph in the bytes of the file ``name``.

    Raises:
        DataRefused: the bytes are no graph, or one that must not be run; the message has the reason.
    """
    try:
        model = onnx.load_model_from_string(data)
    except DecodeError as error:
        raise DataRefused(f"{name} is not ONNX; copy it again") from error
    _check_nodes(model, name)
    for tensor in model.graph.initializer:
        _check_tensor(tensor, name)
    for item in (item for node in model.graph.node for item in node.attribute):
        for tensor in (item.t, *item.tensors) if item.HasField("t") else item.tensors:
            _check_tensor(tensor, name)
    try:
        onnx.checker.check_model(model, full_check=True)
    except (onnx.checker.ValidationError, onnx.shape_inference.InferenceError, ValueError) as error:
        reason = " ".join(str(error).split())[:200]
        raise DataRefused(f"{name} is not a valid graph ({reason}); {_AGAIN}") from error
    _check_inputs(model, name)
    require_bounded(model, name)
    return model


def _check_nodes(model: ModelProto, name: str) -> None:
    graph = model.graph
    if model.functions or model.training_info or graph.sparse_initializer or not graph.node:
        raise DataRefused(f"{name} holds functions, training or sparse numbers, or no operation; {_AGAIN}")
    for node in graph.node:
        if node.domain not in ("", "ai.onnx") or node.op_type not in OPERATIONS:
            asked = f"{node.domain}.{node.op_type}" if node.domain else node.op_type
            raise DataRefused(
                f"{name} asks for the operation {asked!r}, which no network here uses; {_AGAIN}"
            )
        if any(item.HasField("g") or item.graphs for item in node.attribute):
            raise DataRefused(f"{name} has a graph within its operation {node.op_type!r}; {_AGAIN}")


def _check_tensor(tensor: TensorProto, name: str) -> None:
    if tensor.data_location == TensorProto.EXTERNAL or tensor.external_data:
        places = [item.value for item in tensor.external_data if item.key == "location"]
        raise DataRefused(
            f"{name} keeps its numbers {tensor.name!r} in another file, {places}, which is not read: "
            "everything of a graph must be inside it; export it with its weights inside"
        )
    if tensor.data_type not in _KINDS:
        kind = TensorProto.DataType.Name(tensor.data_type)
        raise DataRefused(f"{name}: {tensor.name!r} holds {kind}, which no network here uses; {_AGAIN}")
    try:
        array = numpy_helper.to_array(tensor)
    except (ValueError, TypeError, MemoryError, OverflowError) as error:
        raise DataRefused(f"{name}: {tensor.name!r} does not fill its shape; copy it again") from error
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        bad = int(np.count_nonzero(~np.isfinite(array)))
        raise DataRefused(
            f"{name}: {bad} of the {array.size} numbers {tensor.name!r} are not finite; {_AGAIN}"
        )


def _check_inputs(model: ModelProto, name: str) -> None:
    """Refuse an input that is free in another size than its first, or larger than any sensor's."""
    for value in model.graph.input:
        sizes = list(value.type.tensor_type.shape.dim)
        free = [axis for axis, size in enumerate(sizes) if not size.HasField("dim_value")]
        if not value.type.tensor_type.HasField("shape") or any(axis > 0 for axis in free):
            raise DataRefused(
                f"{name}: its input {value.name!r} is free in other sizes than the first, the number of "
                f"queries; {_AGAIN}"
            )
        numbers = math.prod(size.dim_value for axis, size in enumerate(sizes) if axis not in free)
        if not 0 < numbers <= MAX_INPUT:
            raise DataRefused(
                f"{name}: one query takes {numbers:.3g} numbers {value.name!r}, at most {MAX_INPUT} may be; "
                f"{_AGAIN}"
            )


def declared(model: ModelProto) -> dict[str, tuple[str, tuple[int | str, ...]]]:
    """Type and shape of each input and output of a graph by its name; free sizes by theirs."""
    found: dict[str, tuple[str, tuple[int | str, ...]]] = {}
    for value in (*model.graph.input, *model.graph.output):
        tensor = value.type.tensor_type
        sizes = tuple(
            int(size.dim_value) if size.HasField("dim_value") else size.dim_param for size in tensor.shape.dim
        )
        found[value.name] = (str(np.dtype(helper.tensor_dtype_to_np_dtype(tensor.elem_type))), sizes)
    return found


def require_declared(model: ModelProto, tensors: Sequence[Tensor], name: str) -> None:
    """Refuse a graph that takes or gives something else than is described.

    Raises:
        DataRefused: naming the first value that differs.
    """
    found = declared(model)
    described = {tensor.name: (tensor.dtype, tuple(tensor.shape)) for tensor in tensors}
    for value in dict.fromkeys((*described, *found)):
        if described.get(value) != found.get(value):
            raise DataRefused(
                f"{name}: {value!r} is {found.get(value, 'not')} in the graph and "
                f"{described.get(value, 'not')} in object.json; they were not built together, build again"
            )


def with_outputs(model: ModelProto, names: Sequence[str]) -> bytes:
    """The bytes of a graph that gives some of its outputs alone.

    Operations that only others need are taken out: onnxruntime would run them.
    """
    graph, needed, kept = model.graph, set(names), []
    for node in reversed(graph.node):
        if needed & set(node.output):
            kept.append(node)
            needed |= set(node.input)
    outputs = [value for value in graph.output if value.name in names]
    weights = [value for value in graph.initializer if value.name in needed]
    alone = helper.make_graph(kept[::-1], graph.name, graph.input, outputs, weights)
    return helper.make_model(
        alone, ir_version=model.ir_version, opset_imports=model.opset_import
    ).SerializeToString()
