"""Lines are scored by where they lead; those at a surface lead into it, above the support."""

import numpy as np
import pytest

from experiments.shape_reconstruction.evidence import GuardedTouch, ShapeEvidence
from experiments.shape_reconstruction.explore.choosing import (
    BEYOND,
    blindly,
    farthest,
    lines_at_surface,
    meeting_places,
)
from experiments.shape_reconstruction.fits import UNOBSERVED, ShapeEstimate
from harness.basics.arrays import FloatArray
from harness.basics.geometry import frame_facing, transform, translation
from harness.basics.mesh import Mesh
from harness.bench.sensor import GELSIGHT_R15
from harness.objects.builtin import build
from mocks.world.touch import GelContact, HousingContact

HOUSING = (0.034, 0.030)
NOTHING = np.zeros((0, 3))


def estimated(mesh: Mesh) -> ShapeEstimate:
    known = np.full(len(mesh.vertices), UNOBSERVED)
    return ShapeEstimate(mesh, np.full(len(mesh.vertices), 1e-3), known, (), {}, (), 0.0, "test")


def touched(*places: FloatArray, met: bool = True) -> ShapeEvidence:
    down = frame_facing(np.array([0.0, 0.0, -1.0]), 0.0)
    touches = tuple(
        GuardedTouch(
            transform(down, place),
            0.1,
            place[None] if met else NOTHING,
            np.array([[0.0, 0.0, 1.0]]) if met else NOTHING,
            6e-4,
            0.04,
            k,
        )
        for k, place in enumerate(places)
    )
    return ShapeEvidence(touches, None, HOUSING, 2.5e-3, 0.12, 0.02, 1e-3, 0.3)


def line(end: tuple[float, float, float], forward: tuple[float, float, float]) -> FloatArray:
    return transform(frame_facing(np.array(forward), 0.0), np.array(end))


def test_a_line_meets_the_estimate_where_it_first_enters_it() -> None:
    estimate = estimated(build("tray"))
    top = estimate.mesh.bounds[1, 2]
    beside = line((0.5, 0.5, 0.01), (0.0, 0.0, -1.0))
    into = line((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    met = meeting_places(estimate, np.array([into, beside]))
    assert 0.0 < met[0, 2] < top
    assert met[1] == pytest.approx(beside[:3, 3])


@pytest.mark.parametrize("met", [True, False], ids=["contacts", "misses"])
def test_the_farthest_line_is_the_one_that_leads_where_no_way_has_led(met: bool) -> None:
    evidence = touched(np.array([0.05, 0.0, 0.02]), np.array([0.0, 0.05, 0.02]), met=met)
    lines = np.array([line((x, 0.0, 0.02), (0.0, 0.0, -1.0)) for x in (0.05, 0.0, -0.06)])
    scores = farthest(evidence, None, lines)
    assert scores[0] == pytest.approx(0.0, abs=1e-12)
    assert scores.argmax() == 2
    assert scores[2] == pytest.approx(np.hypot(0.06, 0.05))


def test_without_a_touch_all_lines_are_alike() -> None:
    lines = np.array([line((x, 0.0, 0.02), (0.0, 0.0, -1.0)) for x in (0.0, 0.1)])
    for choose in (farthest, blindly):
        assert choose(touched(), None, lines).tolist() == [0.0, 0.0]


def test_moving_everything_moves_no_score() -> None:
    by = np.array([0.1, -0.2, 0.0])
    places = np.array([0.05, 0.0, 0.02]), np.array([0.0, 0.05, 0.02])
    lines = np.array([line((x, 0.01, 0.02), (0.0, 0.0, -1.0)) for x in (0.05, 0.0, -0.06)])
    moved = lines.copy()
    moved[:, :3, 3] += by
    mesh = build("mug")
    other = Mesh(mesh.vertices + by, mesh.faces)
    before = farthest(touched(*places), estimated(mesh), lines)
    after = farthest(touched(*(place + by for place in places)), estimated(other), moved)
    assert after == pytest.approx(before, abs=1e-9)


@pytest.mark.parametrize("name", ["mug", "plate", "wrench"])
def test_lines_at_a_surface_pass_it_and_keep_the_sensor_off_the_support(name: str) -> None:
    estimate = estimated(build(name))
    lines = lines_at_surface(estimate, GELSIGHT_R15, 100, np.random.default_rng(1))
    assert len(lines) > 5
    lowest = lines[:, 2, 3] - 0.5 * max(HOUSING) * np.linalg.norm(lines[:, :2, 2], axis=1)
    assert np.all(lowest > 0.0)
    passed = np.einsum("ij,ij->i", lines[:, :3, 3] - meeting_places(estimate, lines), lines[:, :3, 2])
    assert np.all(passed > 1e-3)
    assert np.all(passed <= BEYOND + estimate.mesh.diagonal)


@pytest.mark.parametrize("name", ["mug", "bowl", "pitcher", "wrench"])
def test_along_lines_at_a_surface_the_gel_is_pressed_and_the_housing_stays_clear(name: str) -> None:
    """By the mocked world's own contact, at the depth where the gel is pressed by half of a millimetre."""
    mesh = build(name)
    lines = lines_at_surface(estimated(mesh), GELSIGHT_R15, 60, np.random.default_rng(2))
    assert len(lines) > 5
    housing, world = HousingContact(mesh, GELSIGHT_R15), GelContact(mesh, GELSIGHT_R15.window, 5e-4, 5e-3)
    clear = []
    for one in lines:
        ways = np.arange(-0.2, 0.0, 2.5e-4)
        poses = [one @ translation(np.array([0.0, 0.0, way])) for way in ways]
        pressed = next(pose for pose in poses if world.indentation(pose).max() > 0.5e-3)
        clear.append(not housing.wrench(pressed).any())
    assert np.mean(clear) > 0.9


def test_a_surface_with_no_room_above_the_support_has_no_lines() -> None:
    """All of it lower than a line from above ends: an empty answer, not an error in the middle of a run."""
    tray = build("tray")
    flat = Mesh(tray.vertices * [1.0, 1.0, 1e-3], tray.faces)
    level = Mesh(flat.vertices - [0.0, 0.0, flat.bounds[0, 2]], flat.faces)
    assert lines_at_surface(estimated(level), GELSIGHT_R15, 40, np.random.default_rng(3)).shape == (0, 4, 4)
