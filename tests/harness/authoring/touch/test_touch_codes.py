"""Codes of a surface against the rasteriser: laws of presses, accuracy."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial import cKDTree

from harness.authoring.touch.data import DEPTHS, MOST_TILT, choose_nodes, draw_presses
from harness.authoring.touch.metrics import psnr
from harness.authoring.touch.touch import code_surface, opened_codes
from harness.basics.arrays import FloatArray, IntArray
from harness.basics.errors import WrongUse
from harness.basics.mesh import Mesh
from harness.objectfile.surface_search import SurfaceSearch
from harness.objectfile.touch.graph import PatchCodes, blur_matrix, codes_graph
from harness.objectfile.touch.nodes import signatures
from harness.sim.gel.gel import blur, deform, half_kernel
from harness.sim.gel.height_map import RasterMesh
from harness.sim.gel.press_pose import Presses
from tests.samples import touch_bench as tb


def upright(count: int, depth: float = 1e-3, yaw: float = 0.0) -> Presses:
    nodes = tb.coded().nodes
    chosen = np.linspace(0, len(nodes) - 1, count).astype(np.int64)
    nothing = np.zeros(count)
    return Presses(
        nodes.points[chosen], nodes.normals[chosen], nothing + depth, nothing, nothing, nothing + yaw
    )


def test_every_place_of_the_surface_has_a_node_near() -> None:
    nodes = choose_nodes(tb.peg(), tb.SPACING)
    places, normals = SurfaceSearch(tb.peg()).spread(400, 17)
    tree = cKDTree(signatures(nodes.points, nodes.normals))
    assert np.asarray(tree.query(signatures(places, normals))[0]).max() < 1.2 * tb.SPACING
    apart = np.asarray(tree.query(signatures(nodes.points, nodes.normals), 2)[0])[:, 1]
    assert apart.min() > tb.SPACING


def test_nodes_and_presses_are_those_of_their_seed() -> None:
    points = choose_nodes(tb.peg(), tb.SPACING, 3).points
    assert np.array_equal(points, choose_nodes(tb.peg(), tb.SPACING, 3).points)
    assert not np.array_equal(points[:5], choose_nodes(tb.peg(), tb.SPACING, 4).points[:5])
    drawn = draw_presses(tb.peg(), points[:5], 1)
    assert ((drawn.depths >= DEPTHS[0]) & (drawn.depths <= DEPTHS[1])).all()
    assert (drawn.tilts <= MOST_TILT).all()
    with pytest.raises(WrongUse, match=r"\b0(\.0)? m"):
        choose_nodes(tb.peg(), 0.0)


def test_maps_are_the_rasterisers_at_poses_that_were_never_shown() -> None:
    """The issue asks for 40 and 30 dB at trained places, 34 and 24 at others."""
    trained = tb.bench().at_nodes(tb.maps(), 60, 0).rows()
    unseen = tb.bench().between_nodes(tb.maps(), 60, 0).rows()
    assert trained["level"]["psnr_db_median"] > 40.0
    assert trained["level"]["psnr_db_p10"] > 30.0
    assert unseen["level"]["psnr_db_median"] > 34.0
    assert unseen["level"]["psnr_db_p10"] > 24.0
    for found in (trained, unseen):
        assert found["level"]["psnr_db_median"] > found["nearest_trained"]["psnr_db_median"] + 6.0
    assert unseen["nearest_trained"]["psnr_db_median"] > unseen["background"]["psnr_db_median"]


def test_half_a_turn_of_the_gel_turns_the_map() -> None:
    presses = upright(8)
    turned = replace(presses, yaws=presses.yaws + np.pi)
    once, other = tb.maps()(presses), tb.maps()(turned)
    np.testing.assert_allclose(other, once[:, ::-1, ::-1], atol=2e-6)
    assert np.ptp(once, axis=(1, 2)).min() > 1e-4


def test_a_gel_that_touches_nothing_shows_exactly_nothing() -> None:
    far = replace(upright(6), depths=np.full(6, -6e-3))
    assert not tb.maps()(far).any()


def test_beyond_a_patch_there_is_nothing_to_touch() -> None:
    patches = tb.coded().patches
    half = 0.5 * len(patches.inside) * patches.pitch
    # The gel's middle is on the patch's rim, 1 mm deep; its right half is beyond.
    pose = np.eye(4)[None, :3].repeat(2, axis=0)
    pose[0, 0, 3], pose[1, 0, 3], pose[:, 2, 3] = half, 40.0 * half, 1e-3
    maps = tb.maps().network({"node": np.zeros((2, 1), np.int64), "node_from_gel": pose})["maps"]
    assert not maps[0, :, -tb.SENSOR.columns // 3 :].any()
    assert not maps[1].any()


def test_a_deeper_press_is_deeper_everywhere_it_touches() -> None:
    deeper = [tb.maps()(upright(6, depth)) for depth in (0.5e-3, 1e-3, 1.5e-3, 2e-3)]
    for less, more in pairwise(deeper):
        assert (more.max(axis=(1, 2)) > less.max(axis=(1, 2))).all()
        assert (more.sum(axis=(1, 2)) > less.sum(axis=(1, 2))).all()
        assert (more - less).min() > -2e-5
    # Straight down on a coded place, the pixel at the place is as deep as the press.
    held = deeper[1][:, 11:13, 15:17]
    assert abs(np.median(held) - 1e-3) < 1e-4


def test_a_map_in_batches_is_the_map_alone() -> None:
    presses = upright(5)
    alone = np.concatenate([tb.maps()(presses[k : k + 1]) for k in range(5)])
    np.testing.assert_allclose(tb.maps()(presses), alone, atol=1e-8)


def ray_by_ray(patches: PatchCodes, node: int, node_from_gel: FloatArray, lookups: int) -> FloatArray:
    """``(rows, columns)`` penetration in float64, by the definition: no coarse rays."""
    sensor, pitch, patch, cover = tb.SENSOR, patches.pitch, patches.heights(node), patches.covers(node)
    x = (np.arange(sensor.columns) + 0.5 - sensor.columns / 2) * sensor.pitch
    y = (np.arange(sensor.rows) + 0.5 - sensor.rows / 2) * sensor.pitch
    flat = np.stack([*np.meshgrid(x, y), np.zeros((sensor.rows, sensor.columns))], axis=-1)
    base = flat @ node_from_gel[:, :3].T + node_from_gel[:, 3]
    axis, along = node_from_gel[:, 2], np.zeros(base.shape[:2])
    for _ in range(lookups):
        near = np.clip(along, -sensor.gel_thickness, sensor.gel_thickness)
        where = base[..., :2] + near[..., None] * axis[:2]
        at = np.clip(where / pitch + len(patch) / 2 - 0.5, 0.0, len(patch) - 1.0)
        first = np.minimum(at.astype(int), len(patch) - 2)
        u, v = (at - first)[..., 0], (at - first)[..., 1]
        j, i = first[..., 0], first[..., 1]

        def between(
            image: FloatArray, i: IntArray = i, j: IntArray = j, u: FloatArray = u, v: FloatArray = v
        ) -> FloatArray:
            upper = image[i, j] * (1 - u) + image[i, j + 1] * u
            lower = image[i + 1, j] * (1 - u) + image[i + 1, j + 1] * u
            return np.asarray(upper * (1 - v) + lower * v)

        along, covered = (between(patch) - base[..., 2]) / axis[2], between(cover) > 127.5
    return np.where(covered, np.clip(-along, 0.0, sensor.gel_thickness), 0.0)


def test_the_graph_in_float32_is_the_definition_in_float64() -> None:
    """With rays of full width and codes in float32; then what coarse rays and half precision cost."""
    presses = tb.bench().at_nodes(tb.maps(), 12, 5).presses
    asked = tb.maps().nodes.queries(presses)
    patches = tb.coded().patches
    wanted = np.stack([
        deform(ray_by_ray(patches, int(node), pose, 1)[None], tb.SKIRT)[0]
        for node, pose in zip(asked["node"][:, 0], asked["node_from_gel"], strict=True)
    ])  # fmt: skip
    graph = codes_graph(patches, tb.SENSOR, tb.SKIRT, lookups=1, storage="float32")
    exact = opened_codes(graph, tb.coded().nodes, 1.0, tb.SENSOR)(presses)
    assert np.abs(exact - wanted).max() < 2e-7
    three = np.stack([
        deform(ray_by_ray(patches, int(node), pose, 3)[None], tb.SKIRT)[0]
        for node, pose in zip(asked["node"][:, 0], asked["node_from_gel"], strict=True)
    ])  # fmt: skip
    assert np.median(psnr(tb.maps()(presses), three)) > 50.0


@pytest.mark.parametrize("width", [3, 5, 11])
def test_a_blur_by_products_is_the_blur(width: int) -> None:
    image = np.random.default_rng(0).random((12, 17))
    wanted = image.copy()
    blur(wanted, half_kernel(width))
    found = blur_matrix(12, width) @ image @ blur_matrix(17, width).T
    np.testing.assert_allclose(found, wanted, atol=1e-6)


def test_a_mesh_inside_out_has_no_place_to_touch() -> None:
    mesh = Mesh(tb.peg().vertices, tb.peg().faces[:, ::-1])
    with pytest.raises(WrongUse, match="inside out"):
        code_surface(RasterMesh(mesh), choose_nodes(mesh, tb.SPACING), tb.SENSOR, tb.SPEC)


def test_codes_that_do_not_fit_are_refused() -> None:
    patches = tb.coded().patches
    with pytest.raises(WrongUse, match="shapes"):
        codes_graph(replace(patches, mean=patches.mean[:-1]), tb.SENSOR, tb.SKIRT)
    with pytest.raises(WrongUse, match="dome"):
        codes_graph(patches, replace(tb.SENSOR, gel_radius=30e-3), tb.SKIRT)
    with pytest.raises(WrongUse, match="look-ups"):
        codes_graph(patches, tb.SENSOR, tb.SKIRT, lookups=0)
    with pytest.raises(WrongUse, match="finite"):
        codes_graph(replace(patches, codes=patches.codes * np.inf), tb.SENSOR, tb.SKIRT)


def test_maps_of_other_shapes_are_not_compared() -> None:
    with pytest.raises(WrongUse, match=r"\(2, 3, 4\).*\(2, 4, 3\)"):
        psnr(np.zeros((2, 3, 4)), np.zeros((2, 4, 3)))
    assert psnr(np.zeros((1, 3, 4)), np.full((1, 3, 4), 2e-5))[0] == pytest.approx(40.0)
