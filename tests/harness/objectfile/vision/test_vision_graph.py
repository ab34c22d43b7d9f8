"""Networks of vision as a file: what was kept comes back, and the graph says what the weights say."""

from dataclasses import replace
from typing import Any

import numpy as np
import onnx
import pytest
from onnx import numpy_helper

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.errors import DataRefused, WrongUse
from harness.objectfile.runtime import Network
from harness.objectfile.vision.graph import VisionNetworks, kept_weights, vision_graph, vision_tensors
from harness.objectfile.vision.network import (
    COMPACT,
    PAPER,
    NetworkSize,
    VisionGrid,
    VisionModel,
    VisionWeights,
    scatter_rows,
)
from tests.oracles.plain_look import SMALL, box_grid, even_look, file_of, no_weights
from tests.oracles.plain_networks import Query, encoded, evaluate
from tests.samples.fitted_look import drawn_look

TOLD = NetworkSize(kind="osf-v")
LOW = np.array([-0.02, 0.01, 0.3])
GRID = box_grid(LOW, 0.01, (3, 2, 2))
SCALE = 300.0
SIZES = {
    "paper": PAPER,
    "compact": COMPACT,
    "told": TOLD,
    "narrow": NetworkSize(8, 0, 0),
    "odd": NetworkSize(24, 5, 2),
}


def phase(size: NetworkSize) -> float:
    """What the highest octave loses in float32, of the greatest output, with some room for sums."""
    return 2.0**size.octaves * 2.0**-24 * 8.0


def asked(model: VisionModel, count: int, seed: int) -> Query:
    random = np.random.default_rng(seed)
    networks = random.integers(0, len(model.grid), count)
    points = model.grid.low + model.grid.cell * (model.grid.cells[networks] + random.random((count, 3)))
    views = random.standard_normal((count, 3))
    views /= np.linalg.norm(views, axis=1, keepdims=True)
    extras = random.uniform(-1.0, 1.0, (count, model.weights.size.extras))
    return Query(networks, points, views, np.array([0.48, -0.6, 0.64]), extras)


def by_graph(model: VisionModel, query: Query, block: int = 4) -> tuple[AnyArray, AnyArray]:
    """Every sample in a block of its own, which it fills."""
    network = Network(
        file_of(model, block), "vision.onnx", *vision_tensors(model.grid, model.weights.size, block)
    )
    count = len(query.points)

    def spread(rows: FloatArray, kind: str) -> AnyArray:
        return np.repeat(rows[:, None], block, axis=1).astype(kind)

    feed = {
        "network": query.networks[:, None],
        "points": spread(query.points, "f8"),
        "views": spread(query.views, "f4"),
        "light": np.broadcast_to(query.light.astype(np.float32), (count, 3)),
    }
    if model.weights.size.extras:
        feed["extras"] = spread(query.extras, "f4")
    found = network(feed)
    return found["density"][:, 0, 0], found["scattered"][:, 0]


def by_networks(model: VisionModel, query: Query, block: int = 32) -> tuple[AnyArray, AnyArray]:
    """All samples at once, sorted by network into blocks."""
    told = np.zeros((len(query.points), 4), np.float32)
    told[:, : query.extras.shape[1]] = query.extras
    views, light = query.views.astype(np.float32), query.light.astype(np.float32)
    found = VisionNetworks(file_of(model, block)).ask(query.points, views, light, told)
    assert found.known.all()
    return found.density, found.scattered


@pytest.mark.parametrize("name", SIZES)
def test_weights_come_back_bit_for_bit(name: str) -> None:
    model = drawn_look(GRID, SIZES[name], SCALE)
    data = file_of(model)
    back, held = VisionNetworks(data), initializers(data)
    assert (back.size, back.block) == (SIZES[name], 32)
    assert back.density_scale == np.float32(SCALE)
    for key, given in kept_weights(model.weights).items():
        found = held[f"networks.{key}"]
        assert found.dtype == np.float16
        assert given.tobytes() == found.tobytes(), key
    assert np.array_equal(back.grid.cells, GRID.cells)
    assert np.array_equal(back.grid.low, GRID.low)
    assert back.grid.cell == GRID.cell
    kept = 2 * sum(array.size for array in kept_weights(model.weights).values())
    assert kept <= 2 * len(GRID) * SIZES[name].parameters
    assert 0 < len(data) - kept < 20_000


def initializers(data: bytes) -> dict[str, AnyArray]:
    """The constants of a file, by name."""
    held = onnx.load_model_from_string(data).graph.initializer
    return {tensor.name: numpy_helper.to_array(tensor) for tensor in held}


def unlike(size: NetworkSize) -> VisionModel:
    """Networks that have no number in common."""
    random = np.random.default_rng(9)
    arrays = {
        name: random.standard_normal((len(GRID), *shape)) / np.sqrt(max(shape[0], 4))
        for name, shape in size.shapes.items()
    }
    return VisionModel(GRID, VisionWeights(size, SCALE, **arrays).rounded())


def alike(model: VisionModel) -> VisionModel:
    """The same, with rows of views that are 0 and a feature that is passed on as it is."""
    size, arrays = model.weights.size, dict(model.weights.arrays())
    rows, scatter = scatter_rows(size), np.array(arrays["scatter"])
    scatter[:, rows["view"]], scatter[:, rows["feature"]] = 0.0, np.eye(size.width)
    told = arrays | {"scatter": scatter, "feature_bias": np.zeros_like(arrays["feature_bias"])}
    return VisionModel(model.grid, VisionWeights(size, model.weights.density_scale, **told))


def weight_bytes(model: VisionModel) -> int:
    """Of a file, what its weights take."""
    held = vision_graph(model, 4).graph.initializer
    return sum(len(tensor.raw_data) for tensor in held if tensor.name.startswith("networks."))


@pytest.mark.parametrize("name", SIZES)
def test_what_all_networks_have_alike_is_kept_once(name: str) -> None:
    size, model = SIZES[name], unlike(SIZES[name])
    same = alike(model)
    assert sum(array.size for array in kept_weights(model.weights).values()) == len(GRID) * size.parameters
    once = (size.width + size.direction) * size.width + size.width
    assert weight_bytes(model) - weight_bytes(same) == 2 * (len(GRID) - 1) * once
    assert VisionNetworks(file_of(same)).size == size
    query = asked(same, 60, 6)
    density, scattered = evaluate(same, query)
    found_density, found_scattered = by_graph(same, query)
    np.testing.assert_allclose(found_density, density, rtol=0, atol=phase(size) * density.max())
    np.testing.assert_allclose(found_scattered, scattered, rtol=0, atol=phase(size))


def test_zeros_of_two_signs_come_back_as_they_were() -> None:
    same = alike(unlike(SMALL))
    scatter = np.array(same.weights.scatter)
    scatter[2, scatter_rows(SMALL)["view"]] = -0.0
    signed = VisionModel(GRID, replace(same.weights, scatter=scatter))
    view = scatter[:, scatter_rows(SMALL)["view"]]
    assert initializers(file_of(signed))["networks.scatter.view"].tobytes() == view.tobytes()


@pytest.mark.parametrize("name", ["compact", "told"])
def test_files_with_the_whole_layer_are_read_too(name: str) -> None:
    """As they were written before what is alike was kept once."""
    model = unlike(SIZES[name])
    graph = vision_graph(model)
    scatter = np.array(model.weights.scatter)
    graph.graph.initializer.append(numpy_helper.from_array(scatter, "networks.scatter"))
    assert VisionNetworks(graph.SerializeToString()).size == SIZES[name]


def test_sizes_are_the_papers() -> None:
    assert PAPER.parameters == 20_292
    assert (PAPER.place, PAPER.direction) == (63, 27)
    assert PAPER.products == 14_208
    # 40.1 kFLOP a query without folding, as the paper's arithmetic is counted.
    unfolded = sum(int(np.prod(s)) for s in PAPER.shapes.values() if len(s) == 2)
    assert 2 * unfolded == 40_064


@pytest.mark.parametrize("name", SIZES)
def test_the_graph_says_what_plain_float64_says(name: str) -> None:
    model = drawn_look(GRID, SIZES[name], SCALE)
    query = asked(model, 60, 1)
    density, scattered = evaluate(model, query)
    found_density, found_scattered = by_graph(model, query)
    assert density.max() > 0.0
    np.testing.assert_allclose(found_density, density, rtol=0, atol=phase(SIZES[name]) * density.max())
    np.testing.assert_allclose(found_scattered, scattered, rtol=0, atol=phase(SIZES[name]))


@pytest.mark.parametrize("block", [1, 16, 32])
@pytest.mark.parametrize("name", SIZES)
def test_points_in_blocks_say_what_plain_float64_says(name: str, block: int) -> None:
    """Of networks that look the same from every side, and of others."""
    drawn = drawn_look(GRID, SIZES[name], SCALE)
    for model in (drawn, sided(drawn)):
        query = asked(model, 200, 2)
        density, scattered = evaluate(model, query)
        found_density, found_scattered = by_networks(model, query, block)
        np.testing.assert_allclose(found_density, density, rtol=0, atol=phase(SIZES[name]) * density.max())
        np.testing.assert_allclose(found_scattered, scattered, rtol=0, atol=phase(SIZES[name]))


def sided(model: VisionModel) -> VisionModel:
    """The same with colours that depend on the view, in one network alone."""
    rows, scatter = scatter_rows(model.weights.size)["view"], np.array(model.weights.scatter)
    scatter[1, rows] = np.random.default_rng(11).normal(0.0, 0.2, scatter[1, rows].shape)
    return VisionModel(model.grid, replace(model.weights, scatter=scatter))


def test_octaves_are_counted_in_the_cell() -> None:
    """The same networks 25 m away say the same: a phase of 2^9 radians is never taken of a far place."""
    near = drawn_look(GRID, PAPER, SCALE)
    far = VisionModel(replace(GRID, low=LOW + 25.0), near.weights)
    query = asked(near, 40, 3)
    moved = replace(query, points=query.points + 25.0)
    for ask in (by_graph, by_networks):
        density, scattered = ask(near, query)
        far_density, far_scattered = ask(far, moved)
        # 25 m in float64 is known to 4e-15 m: 7e-13 of a half cell, 4e-10 rad in the tenth octave.
        np.testing.assert_allclose(far_density, density, rtol=0, atol=phase(PAPER) * density.max())
        np.testing.assert_allclose(far_scattered, scattered, rtol=0, atol=phase(PAPER))


def test_octaves_are_doubled_in_the_order_of_the_encoding() -> None:
    value = np.array([[0.3, -1.0, 0.7]])
    code = encoded(value, 3)[0]
    assert code.shape == (21,)
    np.testing.assert_array_equal(code[:3], value[0])
    np.testing.assert_allclose(code[3:6], np.sin(value[0]))
    np.testing.assert_allclose(code[18:21], np.cos(4.0 * value[0]))


def test_weights_as_large_as_float16_has_give_finite_numbers() -> None:
    arrays = {name: array + 65504.0 for name, array in no_weights(PAPER, len(GRID)).items()}
    model = VisionModel(GRID, VisionWeights(PAPER, 1.0, **arrays).rounded())
    query = asked(model, 32, 4)
    for found in (*by_graph(model, query), *by_networks(model, query)):
        assert np.isfinite(found).all()


def test_a_light_changes_what_plain_says_it_changes() -> None:
    model = drawn_look(GRID, COMPACT, SCALE)
    query = asked(model, 100, 5)
    for light in ([0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [-0.6, 0.8, 0.0]):
        lit = replace(query, light=np.array(light))
        np.testing.assert_allclose(by_networks(model, lit)[1], evaluate(model, lit)[1], rtol=0, atol=1e-5)


def test_weights_that_do_not_fit_are_refused_by_name() -> None:
    good = dict(even_look(GRID, SCALE, (0.0, 0.0, 0.0)).weights.arrays())
    with pytest.raises(WrongUse, match="'second'"):
        VisionWeights(SMALL, SCALE, **good | {"second": good["second"][:, :-1]})
    spoiled = good["colour_bias"].copy()
    spoiled[2, 1] = np.nan
    with pytest.raises(WrongUse, match=r"'colour_bias' .*1 numbers .*finite"):
        VisionWeights(SMALL, SCALE, **good | {"colour_bias": spoiled})
    too_large = VisionWeights(SMALL, SCALE, **good | {"density": good["density"].astype(np.float64) + 1e5})
    with pytest.raises(WrongUse, match="'density'"):
        too_large.rounded()
    with pytest.raises(WrongUse, match=r"\d+ cells .*\d+ networks"):
        VisionModel(VisionGrid(LOW, 0.01, GRID.cells[1:]), VisionWeights(SMALL, SCALE, **good))
    with pytest.raises(WrongUse, match="scale"):
        VisionWeights(SMALL, 0.0, **good)


@pytest.mark.parametrize(
    "grid",
    [
        {"cell": 0.0},
        {"cell": np.nan},
        {"low": np.array([0.0, np.inf, 0.0])},
        {"cells": np.array([[0, 0, 0], [0, 0, 0]])},
        {"cells": np.array([[-1, 0, 0]])},
        {"cells": np.zeros((0, 3), np.int64)},
    ],
)
def test_a_grid_that_is_none_is_refused(grid: dict[str, Any]) -> None:
    with pytest.raises(WrongUse):
        replace(GRID, **grid)


@pytest.mark.parametrize(
    "size", [{"width": 12}, {"width": 0}, {"octaves": 11}, {"turns": -1}, {"kind": "nerf"}]
)
def test_a_size_that_is_none_is_refused(size: dict[str, int]) -> None:
    with pytest.raises(WrongUse):
        replace(PAPER, **size)  # type: ignore[arg-type]  # that is the case


def test_files_of_something_else_are_refused() -> None:
    data = file_of(even_look(GRID, SCALE, (0.0, 0.0, 0.0)))
    with pytest.raises(DataRefused):
        VisionNetworks(data[: len(data) // 2])
    graph = vision_graph(even_look(GRID, SCALE, (0.0, 0.0, 0.0)))
    for tensor in graph.graph.initializer:
        if tensor.name == "cell":
            tensor.name = "size"
    for node in graph.graph.node:
        node.input[:] = ["size" if name == "cell" else name for name in node.input]
    with pytest.raises(DataRefused, match="'cell'"):
        VisionNetworks(graph.SerializeToString())


def test_a_point_without_a_network_is_told_apart() -> None:
    grid = VisionGrid(LOW, 0.01, GRID.cells[:-1])
    points = LOW + 0.01 * np.array(
        [[0.5, 0.5, 0.5], [3.0, 0.5, 0.5], [2.5, 1.5, 1.5], [3.01, 0.0, 0.0], [-0.01, 0, 0]]
    )
    found = grid.networks(points)
    assert found[0] >= 0
    assert found[1] >= 0, "the greatest corner belongs to the last cell"
    assert (found[2:] == -1).all()


def test_a_point_beside_its_cell_by_rounding_has_its_network() -> None:
    grid = VisionGrid(np.zeros(3), 1.0, np.array([[1, 0, 0]]))
    for x, wanted in ((1.0, 0), (1.0 - 1e-7, 0), (2.0, 0), (2.0 + 1e-7, 0), (0.99, -1), (2.01, -1)):
        assert grid.networks(np.array([[x, 0.5, 0.5]])).tolist() == [wanted]
    points = np.array([[1.5, 1.0, 1.0], [1.5, 1.1, 1.0], [-5.0, 0.5, 0.5]])
    assert grid.networks(points).tolist() == [0, -1, -1]
