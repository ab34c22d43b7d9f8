"""Size of an object never seen, from its outline: better than its box on shapes that were held out."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from experiments.scale_estimation.section import Scale
from experiments.scale_estimation.size import SizeRange
from experiments.scale_estimation.unseen.answer import ShapelessAnswer, outline_alone
from experiments.scale_estimation.unseen.regression import by_outline, features_of, shipped
from experiments.scale_estimation.unseen.training.outlines import fitted, pictures
from harness.basics.errors import FitRefused
from harness.bench.station_file import Station
from harness.sim.solid.household.families import FAMILIES, draw
from harness.sim.solid.walls import enclosed_volume
from tests.experiments.scale_estimation.runs import answered, ran, scene_of
from tests.experiments.scale_estimation.test_vision import FOCAL, PLACE, camera, nominal, outline_at, view_of

RANGE = SizeRange(0.05, 0.6)


@pytest.mark.parametrize("family", FAMILIES)
def test_a_shape_stands_about_its_middle_and_is_one_long(family: str) -> None:
    points = draw(family, np.random.default_rng(2)).inside.nodes
    low, high = points.min(axis=0), points.max(axis=0)
    assert (high - low).max() == pytest.approx(1.0)
    assert low[2] == pytest.approx(0.0)
    assert low[:2] + high[:2] == pytest.approx([0.0, 0.0])


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("seed", range(4))
def test_the_cells_of_a_shape_are_one_body_and_fill_its_surface(family: str, seed: int) -> None:
    shape = draw(family, np.random.default_rng(seed))
    inside, surface = shape.inside, shape.surface
    assert (inside.volumes > 0.0).all()
    edges = np.concatenate([inside.cells[:, [k, (k + 1) % 4]] for k in range(4)])
    linked = coo_array((np.ones(len(edges)), edges.T), shape=(len(inside.nodes),) * 2)
    assert connected_components(linked, directed=False)[0] == 1
    assert trimesh.Trimesh(surface.vertices, surface.faces, process=False).is_watertight
    # Where two tubes of a pot come close they may lap over each other by a little.
    assert enclosed_volume(surface) == pytest.approx(inside.volumes.sum(), rel=0.05)


@pytest.mark.slow  # of a shipped fit, which does not change
def test_shapes_that_were_held_out_are_sized_better_than_by_their_widest_side() -> None:
    features, targets, sizes, numbers = pictures(360, seed=4)
    held = numbers >= 288
    found = fitted(features[~held], targets[~held])
    expected, _ = found.size(features[held])
    ours = np.abs(np.expm1(expected - targets[held])) * sizes[held]
    widest = features[held, :-1].max(axis=1)  # of the outline, at the distance of the object
    box = np.abs(np.expm1(widest - targets[held])) * sizes[held]
    assert ours.mean() < 0.85 * box.mean()


@pytest.mark.slow  # of a shipped fit, which does not change
def test_nine_tenths_of_new_shapes_are_within_the_interval_of_the_shipped_fit() -> None:
    features, targets, _, _ = pictures(360, seed=77)
    expected, sigma = shipped().size(features)
    assert 0.85 < float((np.abs(expected - targets) < 1.645 * sigma).mean()) < 0.95


def test_an_outline_unlike_all_household_things_widens_the_answer() -> None:
    usual, _ = pictures(24, seed=5)[:2]
    strange = usual[:1] + np.append(1.5 * np.tile([1.0, -1.0], 9), 0.0)
    assert shipped().size(strange)[1][0] > 2.0 * shipped().size(usual)[1].max()


def test_an_outline_that_the_picture_cuts_off_is_refused_without_the_shape(station: Station) -> None:
    outline = outline_at(view_of("bowl"), 1.0)
    hidden = outline.hidden.copy()
    hidden[3] = True
    assert isinstance(outline_alone(outline, station.camera, PLACE, RANGE), ShapelessAnswer)
    with pytest.raises(FitRefused, match="outline"):
        outline_alone(replace(outline, hidden=hidden), station.camera, PLACE, RANGE)


def test_twice_as_far_and_twice_as_large_is_the_same_outline() -> None:
    """No scale comes from a picture but by the distance."""
    outline = outline_at(view_of("bowl"), 1.0)
    features, width = features_of(outline, camera(), FOCAL, PLACE)
    away = camera().copy()
    away[:3, 3] = PLACE + 2.0 * (away[:3, 3] - PLACE)
    same, twice = features_of(outline, away, FOCAL, PLACE)
    assert same == pytest.approx(features)
    assert twice == pytest.approx(2.0 * width)


@pytest.mark.parametrize("name", ["mug", "bowl", "pitcher"])
def test_a_built_in_object_is_within_its_interval(name: str) -> None:
    view = view_of(name)
    features, width = features_of(outline_at(view, 1.2), camera(), FOCAL, PLACE)
    low, high = by_outline(features, width, RANGE).interval
    assert low < 1.2 * nominal(view) < high


def test_a_run_tells_the_size_of_an_object_of_unknown_shape_by_sight_alone(
    tmp_path: Path, station: Station
) -> None:
    scene = scene_of(0)
    scene = scene.with_section(Scale(contacts=0, shape="unknown"))
    result = answered(ran(tmp_path / "run", scene, station))
    vision = result["estimates"]["vision"]
    assert not result["shape_known"]
    assert vision["in_interval90"]
