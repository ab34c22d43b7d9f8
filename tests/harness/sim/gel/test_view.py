"""The picture along a tool: the first surface where it is, and limits that no press oversteps."""

from functools import partial

import numpy as np
import pytest
import trimesh

from harness.basics.arrays import FloatArray
from harness.basics.geometry import frame_facing, rotation_from_vector
from harness.basics.mesh import Mesh
from harness.bench.sensor import GELSIGHT_R15
from harness.sim.gel.height_map import RasterMesh, first_surface
from harness.sim.gel.view import POOL, ToolView, view_along, window_depth
from harness.sim.solid.surface_samples import sample_surface
from tests.samples.synthetic_press import Press, box, solid, stepped_block

PITCH = 0.5e-3
RADIUS = 0.02
AWAY = np.array([0.3, -0.2, 0.5])


def pictured(mesh: Mesh, rotation: FloatArray, pitch: float = PITCH) -> ToolView:
    return view_along(partial(first_surface, RasterMesh(mesh)), mesh.vertices, rotation, pitch, GELSIGHT_R15)


def places(view: ToolView) -> FloatArray:
    """``(rows, columns, 2)`` metres: x and y of every pixel."""
    rows, columns = np.indices(view.depth.shape)
    return view.origin + view.pitch * np.stack([columns, rows], axis=-1)


@pytest.mark.parametrize("vector", [(0.0, 0.0, 0.0), (0.4, -0.9, 0.3), (2.0, 1.0, -1.0)])
def test_a_ball_away_from_the_origin_is_seen_as_deep_as_it_is(vector: tuple[float, float, float]) -> None:
    ball = solid(trimesh.creation.icosphere(subdivisions=5, radius=RADIUS))
    rotation = rotation_from_vector(np.array(vector))
    view = pictured(Mesh(ball.vertices + AWAY, ball.faces), rotation)
    centre = AWAY @ rotation
    from_axis = np.linalg.norm(places(view) - centre[:2], axis=2)
    # Flat faces of 1 mm lie up to 5 um inside the ball they stand for.
    met = from_axis < 0.98 * RADIUS
    expected = centre[2] - np.sqrt(RADIUS**2 - from_axis[met] ** 2)
    assert view.depth[met] == pytest.approx(expected, abs=50e-6)
    assert np.isinf(view.depth[from_axis > RADIUS]).all()


def test_the_object_and_a_margin_are_in_the_picture() -> None:
    view = pictured(box(0.06, 0.04, 0.02, (0.01, 0.0, 0.0)), np.eye(3))
    low, high = places(view)[0, 0], places(view)[-1, -1]
    assert np.all(low < [-0.02 - 3e-3, -0.02 - 3e-3])
    assert np.all(high > [0.04 + 3e-3, 0.02 + 3e-3])


def test_moving_the_object_moves_the_picture_and_nothing_in_it() -> None:
    mesh, rotation = stepped_block(), frame_facing(np.array([0.6, 0.0, -0.8]), 0.3)
    here, there = pictured(mesh, rotation), pictured(Mesh(mesh.vertices + AWAY, mesh.faces), rotation)
    by = AWAY @ rotation
    assert there.origin == pytest.approx(here.origin + by[:2], abs=1e-9)
    assert there.depth.shape == here.depth.shape
    both = np.isfinite(here.depth) & np.isfinite(there.depth)
    # A ray along an edge may fall on either side of it.
    assert both.sum() >= 0.99 * max(np.isfinite(here.depth).sum(), np.isfinite(there.depth).sum())
    off = np.abs(there.depth[both] - by[2] - here.depth[both])
    assert np.quantile(off, 0.99) < 1e-9


def test_the_gel_of_every_press_lies_within_the_limits() -> None:
    """Wherever the surface is first met along the tool, however deep the press: the limits rule none out."""
    mesh = stepped_block()
    raster, surface = RasterMesh(mesh), sample_surface(mesh, 4e-3)
    rng = np.random.default_rng(1)
    checked = 0
    for index in rng.choice(len(surface.points), 60, replace=False):
        axis = -surface.normals[index] + 0.15 * rng.uniform(-1.0, 1.0, 3)
        press = Press(
            tuple(surface.points[index]), tuple(axis / np.linalg.norm(axis)), depth=rng.uniform(0.0, 2e-3)
        )
        rotation = press.object_from_gel[:3, :3]
        view = view_along(partial(first_surface, raster), mesh.vertices, rotation, PITCH, GELSIGHT_R15)
        centre = press.object_from_gel[:3, 3] @ view.object_from_view
        column, row = np.round((centre[:2] - view.origin) / view.pitch).astype(np.int64)
        if abs(view.depth[row, column] + press.depth - centre[2]) > 0.2e-3:
            continue  # something else is met first
        window = np.abs(places(view) - centre[:2]) <= 0.5 * np.array(GELSIGHT_R15.window)
        first = view.depth[window.all(axis=2)].min()
        if centre[2] - first > GELSIGHT_R15.gel_thickness:
            continue  # the gel is not so thick
        assert (
            view.nearest[row // POOL, column // POOL] < centre[2] < view.farthest[row // POOL, column // POOL]
        )
        checked += 1
    assert checked > 20


def test_the_limits_rule_out_what_can_not_be() -> None:
    mesh = box(0.06, 0.06, 0.02)
    view = pictured(mesh, frame_facing(np.array([0.0, 0.0, -1.0]), 0.0))
    middle = tuple(side // 2 for side in view.nearest.shape)
    first = -0.01
    assert first - 0.01 < view.nearest[middle] < first
    assert first + GELSIGHT_R15.gel_thickness < view.farthest[middle] < first + 0.01


def test_nothing_is_known_of_a_new_picture() -> None:
    view = pictured(box(0.06, 0.06, 0.02), np.eye(3))
    assert np.isnan(view.score).all()
    assert np.isnan(view.gel_depth).all()
    assert view.score is not view.gel_depth
    assert not view.lean.any()  # where nothing can be felt no turn changes that


@pytest.mark.parametrize("size", [(0.034, 0.030), (0.010, 0.021)])
def test_a_window_is_measured_from_its_centre(size: tuple[float, float]) -> None:
    """A level face 12 mm away, and an odd number of pixels so that one is the centre's."""
    raster = RasterMesh(box(0.2, 0.2, 0.02))
    rotation = frame_facing(np.array([0.0, 0.0, -1.0]), 0.7)
    depth = window_depth(raster, rotation, np.array([0.01, 0.02, 0.022]), size, 1e-3)
    assert depth == pytest.approx(0.012, abs=1e-12)
    assert [side % 2 for side in depth.shape] == [1, 1]
    assert depth.shape == (2 * round(0.5e3 * size[1]) + 1, 2 * round(0.5e3 * size[0]) + 1)


def test_a_window_shows_where_an_edge_is_and_nothing_beyond() -> None:
    """The object ends 5 mm from the centre along the gel's x axis."""
    raster = RasterMesh(box(0.06, 0.06, 0.02))
    rotation = frame_facing(np.array([0.0, 0.0, -1.0]), 0.0)
    edge = 0.03 * rotation[:, 0]
    centre = edge - 5e-3 * rotation[:, 0] + np.array([0.0, 0.0, 0.015])
    depth = window_depth(raster, rotation, centre, (0.03, 0.02), 1e-3)
    x = np.arange(depth.shape[1]) - depth.shape[1] // 2
    assert np.isfinite(depth[:, x < 4.5]).all()
    assert np.isinf(depth[:, x > 5.5]).all()
