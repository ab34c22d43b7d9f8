"""Codes in compiled loops are the graph's own numbers, and no other graph is taken for one of codes."""

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from onnx import ModelProto

from harness.authoring.touch.codes import PatchSpec, code_surface
from harness.authoring.touch.data import choose_nodes, draw_presses
from harness.authoring.touch.touch import opened_codes
from harness.basics.errors import DataRefused
from harness.bench.sensor import GELSIGHT_R15, TactileSensor
from harness.objectfile.file import ObjectFile
from harness.objectfile.surface_search import SurfaceSearch
from harness.objectfile.touch.compiled import CompiledCodes, compiled_codes
from harness.objectfile.touch.graph import codes_graph
from harness.objectfile.touch.kernels import hang
from harness.objectfile.touch.touch import CodeMaps, open_touch
from harness.sim.gel.gel import R15_SKIRT, GelSkirt, deform, half_kernel, skirt_for
from harness.sim.gel.height_map import RasterMesh
from harness.sim.gel.presses import Presses
from tests.samples import touch_bench as tb
from tests.samples.object_bench import exchange

ROUNDING = 2e-8
"""m: 2^-24 of the patch's 50 mm is 3e-9, through slopes to 1 and six sums."""


@pytest.fixture(scope="module")
def peg(tmp_path_factory: pytest.TempPathFactory) -> ObjectFile:
    """Read only; with edges."""
    return tb.peg_file(tmp_path_factory.mktemp("objects") / "peg")


@pytest.fixture(scope="module")
def ball(tmp_path_factory: pytest.TempPathFactory) -> ObjectFile:
    """Read only; without."""
    return tb.ball_file(tmp_path_factory.mktemp("objects") / "ball")


def maps_of(of: ObjectFile, **how: Any) -> CodeMaps:
    found = open_touch(of, "codes", **how).maps
    assert isinstance(found, CodeMaps)
    return found


def drawn(of: ObjectFile, count: int) -> Presses:
    return draw_presses(of.mesh, SurfaceSearch(of.mesh).spread(count, 4)[0], 4)


def recognised(
    graph: ModelProto, of: ObjectFile, sensor: TactileSensor = tb.SENSOR, skirt: GelSkirt = tb.SKIRT
) -> CompiledCodes | None:
    touch = of.description.touch
    assert touch is not None
    assert touch.codes is not None
    return compiled_codes(graph.SerializeToString(deterministic=True), touch.codes.network, sensor, skirt)


def test_without_edges_every_pixel_is_the_graph_s_to_rounding(ball: ObjectFile) -> None:
    asked = drawn(ball, 40)
    compiled, graph = maps_of(ball), maps_of(ball, compiled=False)
    assert isinstance(compiled.network, CompiledCodes)
    assert not isinstance(graph.network, CompiledCodes)
    found = compiled(asked)
    assert found.dtype == np.float32
    assert found.max() > 1e-3
    np.testing.assert_allclose(found, graph(asked), rtol=0.0, atol=ROUNDING)


def test_at_edges_a_pixel_in_a_thousand_may_be_judged_otherwise(peg: ObjectFile) -> None:
    """Half covered is the edge, and rounding says on which side of it a pixel lies; the skirt spreads it."""
    asked = drawn(peg, 120)
    apart = np.abs(maps_of(peg)(asked).astype(np.float64) - maps_of(peg, compiled=False)(asked))
    assert np.count_nonzero(apart > ROUNDING) <= 1e-3 * apart.size
    assert np.sqrt((apart**2).mean()) < 1e-6


@pytest.mark.parametrize("threads", [1, 2, 3])
def test_a_batch_is_its_presses_one_by_one(peg: ObjectFile, threads: int) -> None:
    asked, one = drawn(peg, 7), maps_of(peg)
    whole = maps_of(peg, threads=threads)(asked)
    np.testing.assert_array_equal(whole, np.concatenate([one(asked[k : k + 1]) for k in range(7)]))
    assert maps_of(peg, threads=threads)(asked[:0]).shape == (0, tb.SENSOR.rows, tb.SENSOR.columns)


def test_a_window_that_coarse_rays_do_not_divide_is_computed_too(peg: ObjectFile) -> None:
    odd = replace(tb.SENSOR, rows=23, columns=31)
    skirt, raster = skirt_for(odd), RasterMesh(tb.peg())
    coded = code_surface(raster, choose_nodes(tb.peg(), 12e-3), odd, PatchSpec(12e-3, 0.6e-3), 0)
    graph = codes_graph(coded.patches, odd, skirt)
    onnx = opened_codes(graph, coded.nodes, 0.02, odd)
    asked = onnx.nodes.queries(drawn(peg, 20))
    found = CompiledCodes(coded.patches, odd, skirt)(asked)["maps"]
    apart = np.abs(found - onnx.network(asked)["maps"])
    assert np.count_nonzero(apart > ROUNDING) <= 1e-3 * apart.size


def test_beyond_a_patch_there_is_nothing_to_touch(peg: ObjectFile) -> None:
    compiled, graph = maps_of(peg), maps_of(peg, compiled=False)
    assert isinstance(compiled.network, CompiledCodes)
    patches = tb.coded().patches
    half = 0.5 * len(patches.inside) * patches.pitch
    # The gel's middle is on the patch's rim, 1 mm deep; its right half is beyond.
    pose = np.eye(4)[None, :3].repeat(2, axis=0)
    pose[0, 0, 3], pose[1, 0, 3], pose[:, 2, 3] = half, 40.0 * half, 1e-3
    asked = {"node": np.zeros((2, 1), np.int64), "node_from_gel": pose}
    maps = graph.network(asked)["maps"]
    np.testing.assert_allclose(compiled.network(asked)["maps"], maps, rtol=0.0, atol=ROUNDING)
    assert not maps[0, :, -tb.SENSOR.columns // 3 :].any()
    assert not maps[1].any()


def test_only_what_codes_graph_makes_is_taken_for_codes(peg: ObjectFile) -> None:
    patches = tb.coded().patches
    assert recognised(codes_graph(patches, tb.SENSOR, tb.SKIRT), peg) is not None
    assert recognised(codes_graph(patches, tb.SENSOR, tb.SKIRT, lookups=2), peg) is None
    assert recognised(codes_graph(patches, tb.SENSOR, tb.SKIRT, storage="float32"), peg) is None
    assert recognised(codes_graph(patches, tb.SENSOR, R15_SKIRT), peg) is None
    assert recognised(codes_graph(patches, tb.SENSOR, tb.SKIRT), peg, skirt=R15_SKIRT) is None
    spec = PatchSpec(tb.SPACING, 0.6e-3, width=16)
    basis = code_surface(RasterMesh(tb.peg()), choose_nodes(tb.peg(), tb.SPACING), tb.SENSOR, spec, 0)
    assert recognised(codes_graph(basis.patches, tb.SENSOR, tb.SKIRT), peg) is None
    other = codes_graph(patches, tb.SENSOR, tb.SKIRT)
    other.graph.node[-1].name = "else"
    assert recognised(other, peg) is None


def test_a_graph_that_is_not_recognised_runs_as_it_is(peg: ObjectFile, tmp_path: Path) -> None:
    shutil.copytree(peg.folder, tmp_path / "peg")
    graph = codes_graph(tb.coded().patches, tb.SENSOR, tb.SKIRT, lookups=4)
    of = exchange(tmp_path / "peg", "touch.onnx", graph.SerializeToString(deterministic=True))
    maps, asked = maps_of(of), drawn(peg, 5)
    assert not isinstance(maps.network, CompiledCodes)
    assert np.sqrt(((maps(asked) - maps_of(peg)(asked)) ** 2).mean()) < 2e-5


@pytest.mark.parametrize("node", [-1, 100_000])
def test_a_node_that_there_is_not_is_refused(peg: ObjectFile, node: int) -> None:
    asked = {"node": np.array([[0], [node]]), "node_from_gel": np.tile(np.eye(4)[:3], (2, 1, 1))}
    with pytest.raises(DataRefused, match="not built together"):
        maps_of(peg).network(asked)


@pytest.mark.parametrize("skirt", [R15_SKIRT, GelSkirt((1, 7), 1, 0.3)], ids=["r1.5", "short"])
@pytest.mark.parametrize("shape", [(GELSIGHT_R15.rows, GELSIGHT_R15.columns), (7, 9)])
def test_the_skirt_is_that_of_the_simulator(skirt: GelSkirt, shape: tuple[int, int]) -> None:
    deep = np.maximum(0.0, np.random.default_rng(3).normal(0.5e-3, 1e-3, shape)).astype(np.float32)
    found = deep.copy()
    halves = tuple(half_kernel(width).astype(np.float32) for width in (*skirt.kernels, skirt.final))
    hang(found, halves, np.float32(skirt.core) * deep.max())
    np.testing.assert_allclose(found, deform(deep[None].astype(np.float64), skirt)[0], atol=2e-9)
