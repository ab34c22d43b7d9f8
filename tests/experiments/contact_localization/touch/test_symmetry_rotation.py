"""Turns that an object does not show: found, harmless to what is read, and spread evenly."""

import numpy as np
import pytest

from experiments.contact_localization.model import Turning, turning_of
from harness.basics.geometry import rotation_about
from harness.objects.household import build
from harness.sim.gel.height_map import RasterMesh, depth_image

UP = np.array([0.0, 0.0, 1.0])
ACROSS = np.array([1.0, 0.0, 0.0])


@pytest.mark.parametrize(
    ("name", "fold"), [("bowl", 0), ("plate", 0), ("tray", 4), ("mug", 1), ("wrench", 1)]
)
def test_household_objects_show_what_their_shape_says(name: str, fold: int) -> None:
    assert turning_of(build(name), UP).fold == fold


def test_a_bowl_on_its_side_shows_its_yaw() -> None:
    assert turning_of(build("bowl"), ACROSS).fold == 1


@pytest.mark.parametrize("name", ["bowl", "tray"])
def test_a_turn_of_the_group_leaves_the_picture_as_it_was(name: str) -> None:
    mesh = build(name)
    turning = turning_of(mesh, UP)
    angle = float(turning.spread(3)[1]) if turning.fold == 0 else turning.period
    tilted = rotation_about(ACROSS, 0.4)
    at = mesh.bounds.mean(axis=0)

    def seen(points: np.ndarray) -> np.ndarray:
        gel_from_object = np.eye(4)
        gel_from_object[:3, :3] = tilted
        gel_from_object[:3, 3] = -tilted @ at
        return depth_image(RasterMesh(type(mesh)(points, mesh.faces)), gel_from_object, 2e-3, 40, 40).depth

    before = seen(mesh.vertices)
    after = seen(turning.turned(mesh.vertices, np.full(len(mesh.vertices), angle)))
    both = np.isfinite(before) & np.isfinite(after)
    assert np.isfinite(before).sum() == pytest.approx(np.isfinite(after).sum(), rel=0.05)
    assert np.median(np.abs(before - after)[both]) < 0.2e-3


@pytest.mark.parametrize("fold", [0, 1, 2, 4])
def test_turns_belong_to_the_group_and_are_used_evenly(fold: int) -> None:
    turning = Turning(np.array([0.01, -0.02, 0.0]), UP, fold)
    turns = turning.spread(4000)
    steps = turns * max(fold, 1) / (2.0 * np.pi)
    if fold:
        assert np.allclose(steps, np.round(steps))
    filled = np.bincount(np.floor(turns / (2.0 * np.pi) * 12.0).astype(int), minlength=12)
    used = filled[filled > 0]
    assert used.max() - used.min() <= 3
    assert len(used) == (12 if fold == 0 else fold)


@pytest.mark.parametrize("fold", [0, 1, 2, 4])
@pytest.mark.parametrize("count", [1, 3, 500])
def test_copies_weigh_what_they_are_copies_of_and_fill_every_turn(fold: int, count: int) -> None:
    weights = np.random.default_rng(count).dirichlet(np.ones(count))
    turning = Turning(np.zeros(3), UP, fold)
    owners, turns, shares = turning.copies(weights, 4000)
    assert np.bincount(owners, shares) == pytest.approx(weights)
    assert np.all(np.diff(owners) >= 0)
    if fold == 1:
        assert np.all(turns == 0.0)
        return
    assert shares.max() <= 1.0 / 4000
    parts = fold or 40
    filled = np.bincount(np.floor(turns / (2.0 * np.pi) * parts + 1e-9).astype(int), shares)
    assert filled == pytest.approx(np.full(parts, 1.0 / parts), rel=0.1)


def test_a_turned_point_keeps_its_height_and_its_distance_from_the_line() -> None:
    rng = np.random.default_rng(0)
    points, turning = rng.normal(size=(50, 3)), Turning(rng.normal(size=3), UP, 0)
    turned = turning.turned(points, rng.uniform(0.0, 7.0, 50))
    reach = np.linalg.norm((points - turning.centre)[:, :2], axis=1)
    assert np.allclose(turned[:, 2], points[:, 2])
    assert np.allclose(np.linalg.norm((turned - turning.centre)[:, :2], axis=1), reach)
