"""A graph from a stranger is looked through before it is run; what could do harm is refused by name."""

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import pytest
from onnx import ModelProto, NodeProto, TensorProto, helper, numpy_helper

from harness.authoring.audio.audio import waves_graph
from harness.basics.arrays import AnyArray
from harness.basics.errors import DataRefused
from harness.objectfile import graph_cost
from harness.objectfile.entries import Domain, Input, Tensor
from harness.objectfile.graph_check import checked_graph, declared
from harness.objectfile.graph_cost import GraphCost, query_cost
from harness.objectfile.runtime import Network
from tests.samples.object_bench import MODES, egg_waves


def good() -> ModelProto:
    return waves_graph(egg_waves())


def tiny(nodes: list[NodeProto], constants: dict[str, AnyArray] | None = None, axes: int = 2) -> ModelProto:
    """A graph from ``x``, float32 ``(n, 3)``, to ``y`` of as many axes, of any sizes."""
    graph = helper.make_graph(
        nodes,
        "tiny",
        [helper.make_tensor_value_info("x", TensorProto.FLOAT, ["n", 3])],
        [helper.make_tensor_value_info("y", TensorProto.FLOAT, list("abcd"[:axes]))],
        [numpy_helper.from_array(array, name) for name, array in (constants or {}).items()],
    )
    return helper.make_model(graph, ir_version=8, opset_imports=[helper.make_opsetid("", 17)])


def refused(model: ModelProto) -> str:
    with pytest.raises(DataRefused) as caught:
        checked_graph(model.SerializeToString(), "x.onnx")
    return str(caught.value)


def test_a_network_of_ours_passes() -> None:
    model = checked_graph(good().SerializeToString(), "audio.onnx")
    assert declared(model) == {
        "points": ("float64", ("n", 3)),
        "gains": ("float32", ("n", MODES, 3)),
    }


@pytest.mark.parametrize("location", ["/etc/passwd", "../secret.bin", "weights.bin"])
def test_weights_in_another_file_are_refused_wherever_it_is(location: str) -> None:
    model = good()
    tensor = model.graph.initializer[2]
    tensor.ClearField("raw_data")
    tensor.data_location = TensorProto.EXTERNAL
    tensor.external_data.add(key="location", value=location)
    said = refused(model)
    assert location in said
    assert "another file" in said


def test_weights_outside_are_refused_inside_an_attribute_too() -> None:
    value = helper.make_tensor("t", TensorProto.FLOAT, [3], [1.0, 2.0, 3.0])
    value.data_location = TensorProto.EXTERNAL
    value.external_data.add(key="location", value="/dev/zero")
    nodes = [helper.make_node("Constant", [], ["c"]), helper.make_node("Add", ["x", "c"], ["y"])]
    nodes[0].attribute.add(name="value", type=onnx.AttributeProto.TENSOR).t.CopyFrom(value)
    assert "/dev/zero" in refused(tiny(nodes))


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_weights_that_are_not_finite_are_refused(bad: float) -> None:
    model = good()
    index = next(i for i, t in enumerate(model.graph.initializer) if t.data_type == TensorProto.FLOAT)
    array = numpy_helper.to_array(model.graph.initializer[index]).copy()
    array.flat[0] = bad
    model.graph.initializer[index].CopyFrom(
        numpy_helper.from_array(array, model.graph.initializer[index].name)
    )
    assert "1 of the" in refused(model)


@pytest.mark.parametrize("domain", ["com.microsoft", "evil.corp"])
def test_operations_of_others_are_refused(domain: str) -> None:
    node = helper.make_node("Relu", ["x"], ["y"], domain=domain)
    assert f"{domain}.Relu" in refused(tiny([node]))


def test_loops_are_refused() -> None:
    body = helper.make_graph([helper.make_node("Identity", ["a"], ["b"])], "body", [], [])
    node = helper.make_node("Loop", ["", "", "x"], ["y"], body=body)
    assert "'Loop'" in refused(tiny([node]))


def test_functions_of_the_files_own_are_refused() -> None:
    model = tiny([helper.make_node("Relu", ["x"], ["y"])])
    model.functions.add(name="Relu", domain="evil")
    assert "functions" in refused(model)


def test_a_result_larger_than_any_memory_is_refused_before_it_is_computed() -> None:
    shape = np.array([2**20, 2**20, 3])
    node = helper.make_node("Expand", ["x", "s"], ["y"])
    said = refused(tiny([node], {"s": shape}, axes=3))
    assert "3.3e+12 numbers" in said


def test_an_outer_product_of_small_weights_that_becomes_huge_is_refused() -> None:
    side = np.zeros((8192, 1), np.float32)
    nodes = [helper.make_node("MatMul", ["a", "b"], ["big"]), helper.make_node("ReduceSum", ["big"], ["y"])]
    assert "6.71e+07 numbers" in refused(tiny(nodes, {"a": side, "b": side.T.copy()}))


def test_a_size_that_depends_on_the_numbers_asked_is_refused() -> None:
    nodes = [
        helper.make_node("Cast", ["x"], ["i"], to=TensorProto.INT64),
        helper.make_node("Gather", ["i", "zero"], ["shape"], axis=0),
        helper.make_node("Expand", ["x", "shape"], ["y"]),
    ]
    assert "not known before" in refused(tiny(nodes, {"zero": np.array(0)}, axes=3))


def test_a_query_larger_than_any_sensor_is_refused() -> None:
    model = tiny([helper.make_node("Relu", ["x"], ["y"])])
    model.graph.input[0].type.tensor_type.shape.dim[1].dim_value = 10**9
    assert "65536" in refused(model)


def test_numbers_that_do_not_fill_their_shape_are_refused() -> None:
    model = good()
    model.graph.initializer[1].dims[0] = 10**9
    assert "shape" in refused(model)


def test_a_pickle_is_not_a_graph(tmp_path: Path) -> None:
    class Runs:
        def __reduce__(self) -> tuple[object, tuple[str]]:
            return (Path.touch, (Path(tmp_path / "ran"),))  # type: ignore[return-value]

    with pytest.raises(DataRefused):
        checked_graph(pickle.dumps(Runs()), "audio.onnx")
    assert not (tmp_path / "ran").exists()


@pytest.mark.parametrize("share", [0.0, 0.01, 0.5, 0.999])
def test_a_file_cut_short_is_refused(share: float) -> None:
    data = good().SerializeToString()
    with pytest.raises(DataRefused):
        checked_graph(data[: int(share * len(data))], "audio.onnx")


def test_a_graph_whose_operations_do_not_fit_together_is_refused() -> None:
    node = helper.make_node("MatMul", ["x", "w"], ["y"])
    assert "graph" in refused(tiny([node], {"w": np.zeros((4, 2), np.float32)}))


def of_a_query(shape: list[int]) -> tuple[list[NodeProto], dict[str, AnyArray]]:
    """Nodes that make ``big`` of a shape from the first number of a query."""
    nodes = [
        helper.make_node("Slice", ["x", "zero", "one", "one"], ["first"]),
        helper.make_node("Unsqueeze", ["first", "one"], ["column"]),
        helper.make_node("Expand", ["column", "shape"], ["big"]),
    ]
    return nodes, {"zero": np.array([0]), "one": np.array([1]), "shape": np.array(shape)}


def test_many_values_at_the_same_time_are_refused_though_each_is_small_enough() -> None:
    """As 6 KB of a file take 6.4 GB: 24 values of 2^22 numbers, and a sum of all."""
    nodes, constants = of_a_query([1, 2**11, 2**11])
    nodes += [helper.make_node("Sin", ["big"], [f"s{k}"]) for k in range(24)]
    nodes += [helper.make_node("Max", [f"s{k}" for k in range(24)], ["all"])]
    nodes += [helper.make_node("ReduceMax", ["all"], ["y"], axes=[2], keepdims=0)]
    assert "4.19e+08 bytes" in refused(tiny(nodes, constants))


def test_values_one_after_the_other_are_no_sum() -> None:
    nodes, constants = of_a_query([1, 2**10, 2**10])
    nodes += [helper.make_node("Sin", ["big" if k == 0 else f"s{k - 1}"], [f"s{k}"]) for k in range(100)]
    nodes += [helper.make_node("ReduceMax", ["s99"], ["y"], axes=[2], keepdims=0)]
    data = tiny(nodes, constants).SerializeToString()
    cost = query_cost(checked_graph(data, "x.onnx"), "x.onnx")
    assert cost.live_bytes == pytest.approx(2 * 4 * 2**20, rel=0.01)
    assert cost.work == pytest.approx(102 * 4 * 2**20, rel=0.01)


def test_sums_of_constants_are_refused_before_onnxruntime_folds_them() -> None:
    """Each is dead after the next operation, and onnxruntime would keep or compute all of them at start."""
    constants = {"one": np.ones((1, 1), np.float32), "shape": np.array([2**11, 2**11])}
    nodes = [helper.make_node("Expand", ["one", "shape"], ["big"])]
    nodes += [helper.make_node("Sin", ["big" if k == 0 else f"s{k - 1}"], [f"s{k}"]) for k in range(60)]
    nodes += [
        helper.make_node("ReduceMax", ["s59"], ["least"], keepdims=0),
        helper.make_node("Add", ["x", "least"], ["y"]),
    ]
    assert "1.02e+09 bytes" in refused(tiny(nodes, constants))


def test_products_of_constants_are_refused_before_onnxruntime_folds_them() -> None:
    constants = {"one": np.ones((1, 1), np.float32), "shape": np.array([2**11, 2**11])}
    nodes = [helper.make_node("Expand", ["one", "shape"], ["p0"])]
    nodes += [helper.make_node("MatMul", [f"p{k}", "p0"], [f"p{k + 1}"]) for k in range(5)]
    nodes += [
        helper.make_node("ReduceMax", ["p5"], ["least"], keepdims=0),
        helper.make_node("Add", ["x", "least"], ["y"]),
    ]
    assert "constants alone take 4.3e+10 operations" in refused(tiny(nodes, constants))


def test_products_of_a_query_are_refused() -> None:
    nodes, constants = of_a_query([1, 2**11, 2**11])
    nodes += [
        helper.make_node("MatMul", ["big" if k == 0 else f"p{k - 1}", "big"], [f"p{k}"]) for k in range(5)
    ]
    nodes += [helper.make_node("ReduceMax", ["p4"], ["y"], axes=[2], keepdims=0)]
    assert "one query takes 4.3e+10 operations" in refused(tiny(nodes, constants))


def test_values_that_grow_with_the_square_of_the_queries_are_refused() -> None:
    nodes = [
        helper.make_node("Transpose", ["x"], ["t"], perm=[1, 0]),
        helper.make_node("MatMul", ["x", "t"], ["y"]),
    ]
    assert "'y' has 1 " in refused(tiny(nodes))


@pytest.mark.parametrize("kept", [4, 900])
def test_values_that_grow_late_are_refused(kept: int) -> None:
    """The square of the queries beyond some number, one number before."""
    nodes = [
        helper.make_node("Slice", ["x", "kept", "end", "zero"], ["late"]),
        helper.make_node("Slice", ["late", "zero", "one", "one"], ["column"]),
        helper.make_node("Transpose", ["column"], ["row"], perm=[1, 0]),
        helper.make_node("MatMul", ["column", "row"], ["y"]),
    ]
    constants = {
        "kept": np.array([kept]),
        "end": np.array([2**40]),
        "zero": np.array([0]),
        "one": np.array([1]),
    }
    assert "numbers for one query" in refused(tiny(nodes, constants))


def test_a_size_beyond_the_number_of_queries_must_be_stated() -> None:
    model = tiny([helper.make_node("Relu", ["x"], ["y"])])
    model.graph.input[0].type.tensor_type.shape.dim[1].dim_param = "m"
    assert "free in other sizes than the first" in refused(model)


def test_calls_of_too_many_queries_are_refused() -> None:
    cost = GraphCost(live_bytes=2**20, work=2**24)
    cost.require_call(512, "x.onnx")
    with pytest.raises(DataRefused, match=r"x\.onnx: 513 .* 513 MiB.* 512 MiB"):
        cost.require_call(513, "x.onnx")
    with pytest.raises(DataRefused, match=r"x\.onnx: 4 .*5\.5e\+11 operations"):
        GraphCost(live_bytes=1, work=2**37).require_call(4, "x.onnx")


def test_a_network_refuses_a_call_of_too_many_queries(monkeypatch: pytest.MonkeyPatch) -> None:
    entries: dict[str, Any] = {"dtype": "float32", "shape": ("n", 3), "unit": "m", "meaning": "of the test"}
    model = tiny([helper.make_node("Relu", ["x"], ["y"])])
    model.graph.output[0].type.CopyFrom(model.graph.input[0].type)
    inputs = (Input(name="x", domain=Domain(near_surface_m=1.0), normaliser="in the graph", **entries),)
    network = Network(model.SerializeToString(), "x.onnx", inputs, (Tensor(name="y", **entries),))
    monkeypatch.setattr(graph_cost, "MAX_CALL_BYTES", 12 * 7)
    assert len(network({"x": np.zeros((7, 3), np.float32)})["y"]) == 7
    with pytest.raises(DataRefused, match=r"\b8 queries"):
        network({"x": np.zeros((8, 3), np.float32)})
