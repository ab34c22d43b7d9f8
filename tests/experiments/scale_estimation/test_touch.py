"""Size by touch: contacts on a model itself are read back; what they leave open stays open."""

from dataclasses import replace
from functools import cache
from itertools import product

import numpy as np
import pytest

from experiments.scale_estimation.model import ObjectModel
from experiments.scale_estimation.size import STEP, Belief, SizeRange
from experiments.scale_estimation.touch.fit import (
    POINTS,
    THROUGH,
    UNKNOWNS,
    FreeSpace,
    Patch,
    Stand,
    StandErrors,
    distinct_paths,
    patch_of,
)
from experiments.scale_estimation.touch.touch import Touch, by_touch, doubted_cost
from harness.basics.arrays import FloatArray
from harness.basics.errors import FitRefused
from harness.basics.geometry import rotation_about, transform
from harness.bench.gap import USUAL
from harness.bench.station_file import Station
from harness.objects.household import build
from harness.sim.solid.surface_samples import sample_surface
from tests.experiments.scale_estimation.runs import scene_of

RANGE = SizeRange(0.05, 0.45)
PLACE = np.array([-0.42, 0.0, 0.25])
UP = np.array([0.0, 0.0, 1.0])


@cache
def stand_of(name: str) -> tuple[Stand, float]:
    mesh = build(name)
    nominal = float(np.ptp(mesh.bounds, axis=0).max())
    low, high = mesh.bounds
    anchor = np.array([*(0.5 * (low + high))[:2], low[2]])
    return Stand.of(sample_surface(mesh, nominal / 60), np.eye(3), anchor, PLACE), nominal


def contacts(
    name: str, scale: float, count: int, seed: int = 0, yaw: float = 0.7, sigma: float = 0.5e-3
) -> list[Patch]:
    """Presses all over an object that is larger by a factor, turned and moved."""
    stand, _ = stand_of(name)
    random = np.random.default_rng(seed)
    turn, moved = rotation_about(UP, yaw), np.array([0.01, -0.015, 0.0])
    outer = np.flatnonzero(stand.normals[:, 2] > -0.3)
    made = []
    for index in random.choice(outer, count, replace=False):
        near = np.argsort(np.linalg.norm(stand.points - stand.points[index], axis=1) * scale)[:POINTS]
        facing = near[(stand.normals[near] @ stand.normals[index]) > 0.7]
        points = stand.points[np.resize(facing, POINTS)] * scale
        error = sigma * random.standard_normal(3)
        made.append(Patch(points @ turn.T + moved + PLACE + error, turn @ stand.normals[index]))
    return made


QUICK = (("mug", 0.6), ("bowl", 1.0), ("pitcher", 1.7))
"""Every object and every size once."""
OTHERS = [pair for pair in product(("mug", "bowl", "pitcher"), (0.6, 1.0, 1.7)) if pair not in QUICK]


@pytest.mark.parametrize(
    ("name", "scale"), [*QUICK, *(pytest.param(*pair, marks=pytest.mark.slow) for pair in OTHERS)]
)
def test_contacts_all_over_give_the_size(name: str, scale: float) -> None:
    stand, nominal = stand_of(name)
    found = by_touch(stand, contacts(name, scale, 10), nominal, RANGE)
    assert found.belief.size == pytest.approx(scale * nominal, rel=0.03)
    low, high = found.belief.interval
    assert 0.98 * low < scale * nominal < 1.02 * high


def test_a_station_that_knows_less_where_its_gel_is_leaves_more_of_the_size_open() -> None:
    stand, nominal = stand_of("bowl")
    made, widths = contacts("bowl", 1.0, 10), []
    for errors in (USUAL, USUAL.times(4.0)):
        there = replace(stand, errors=StandErrors.at(errors, 0.1, 1e-3))
        low, high = by_touch(there, made, nominal, RANGE).belief.interval
        widths.append(high / low - 1.0)
    assert widths[1] > 1.1 * widths[0]


def test_how_well_the_gel_s_place_is_known_is_the_station_s_word(station: Station) -> None:
    rough = station.model_copy(update={"errors": station.errors.times(3.0)})
    usual, worse = (
        ObjectModel(build("bowl"), scene_of(3, camera=False, mesh="builtin:bowl"), one).stand.errors
        for one in (station, rough)
    )
    assert worse.depth > 2.0 * usual.depth
    assert worse.tilt == pytest.approx(3.0 * usual.tilt)


def test_one_contact_says_hardly_anything() -> None:
    stand, nominal = stand_of("mug")
    found = by_touch(stand, contacts("mug", 1.0, 1), nominal, RANGE)
    low, high = found.belief.interval
    assert high / low > 2.0


def repeated(patch: Patch, times: int, seed: int) -> list[Patch]:
    """The same press again, each with a fresh error of the arm and of the gel's reading."""
    random = np.random.default_rng(seed)
    copies = []
    for _ in range(times):
        moved = patch.points + 0.3e-3 * random.standard_normal(3)
        copies.append(Patch(moved + 0.02e-3 * random.standard_normal(patch.points.shape), patch.normal))
    return copies


@pytest.mark.parametrize("count", [1, 2, 5])
def test_the_same_touch_ten_times_gives_the_interval_of_one(count: int) -> None:
    stand, nominal = stand_of("mug")
    made = contacts("mug", 1.0, count)
    once = by_touch(stand, made, nominal, RANGE)
    copied = by_touch(stand, [made[0]] * 9 + made, nominal, RANGE)
    assert copied.belief.interval == pytest.approx(once.belief.interval, rel=1e-4)
    assert copied.cost == pytest.approx(once.cost, abs=1e-4)
    low, high = copied.belief.interval
    assert low < nominal < high


def test_the_same_touch_read_ten_times_gives_nearly_the_interval_of_one() -> None:
    stand, nominal = stand_of("mug")
    made = contacts("mug", 1.0, 5)
    low, high = by_touch(stand, made, nominal, RANGE).belief.interval
    again = by_touch(stand, [*made, *repeated(made[0], 9, 1)], nominal, RANGE).belief.interval
    assert low < nominal < high
    assert again == pytest.approx((low, high), rel=0.01)
    assert again[1] / again[0] > 1.0 + 0.8 * (high / low - 1.0)


def test_a_path_to_the_same_place_again_is_no_new_evidence() -> None:
    stand, nominal = stand_of("tray")
    aside = PLACE + np.array([0.75 * nominal, 0.0, 0.0])
    path = aside + np.linspace(0.001, 0.2, 140)[:, None] * UP
    shorter, elsewhere = path[:70], path + np.array([0.02, 0.0, 0.0])
    kept = distinct_paths([shorter, path, elsewhere, path[:1]], stand.errors.same_place)
    assert [one.tolist() for one in kept] == [path.tolist(), elsewhere.tolist(), path[:1].tolist()]
    assert distinct_paths([], stand.errors.same_place) == []
    made = contacts("tray", 1.0, 3)
    once, copied = (by_touch(stand, made, nominal, RANGE, free=[path] * times) for times in (1, 10))
    assert copied.belief.interval == pytest.approx(once.belief.interval)


@pytest.mark.parametrize("count", [2, 3, 4])
def test_few_contacts_may_fit_any_size_by_chance(count: int) -> None:
    """Each further contact halves the probability, which is then spread over all sizes."""
    stand, nominal = stand_of("mug")
    density = np.exp(by_touch(stand, contacts("mug", 1.0, count), nominal, RANGE).belief.log_density)
    uniform = 1.0 / (STEP * len(density))
    assert density.min() == pytest.approx(0.5 ** (count - 1) * uniform, rel=0.02)


def with_wrong_normal(patch: Patch) -> Patch:
    """A press on a rim: its points are right, and the normal of their plane is a quarter turn off."""
    return replace(patch, normal=np.cross(patch.normal, np.roll(patch.normal, 1)))


@pytest.mark.parametrize("count", [2, 3])
def test_one_contact_on_a_rim_among_few_is_no_sign_of_another_object(count: int) -> None:
    stand, nominal = stand_of("mug")
    first, *others = contacts("mug", 1.0, count)
    found = by_touch(stand, [with_wrong_normal(first), *others], nominal, RANGE)
    assert found.places == count
    assert not found.is_doubted


def test_the_limit_of_doubt_falls_with_the_number_of_places() -> None:
    limits = [doubted_cost(places) for places in (1, 2, 5, 10, 40)]
    assert limits == pytest.approx([2.2136, 1.5652, 0.9899, 0.7, 0.7], abs=1e-3)
    belief = Belief.ignorant(RANGE)
    assert Touch(belief, np.zeros(UNKNOWNS), 1.0, 0.0, 10).is_doubted
    assert not Touch(belief, np.zeros(UNKNOWNS), 1.0, 0.0, 4).is_doubted
    assert Touch(belief, np.zeros(UNKNOWNS), 1.2, 0.0, 4).is_doubted
    assert not Touch(belief, np.zeros(UNKNOWNS), 3.0, 0.0, 3).is_doubted


def test_doubted_contacts_leave_half_of_the_probability_to_any_size(monkeypatch: pytest.MonkeyPatch) -> None:
    stand, nominal = stand_of("mug")
    monkeypatch.setattr("experiments.scale_estimation.touch.touch.DOUBTED", 0.0)
    found = by_touch(stand, contacts("mug", 1.0, 10), nominal, RANGE)
    density = np.exp(found.belief.log_density)
    assert density.min() == pytest.approx(0.5 / (STEP * len(density)), rel=0.02)


def test_contacts_on_one_side_leave_the_size_open() -> None:
    """A wall touched on one side only: large and far, or small and near."""
    stand, nominal = stand_of("mug")
    angle, heights = 0.0, np.linspace(0.03, 0.06, 6)
    out = np.array([np.cos(angle), np.sin(angle), 0.0])
    patches = []
    for height in heights:
        middle = PLACE + 0.04 * out + height * UP
        across = np.linspace(-4e-3, 4e-3, POINTS)[:, None] * UP
        patches.append(Patch(middle + across, out))
    found = by_touch(stand, patches, nominal, RANGE)
    low, high = found.belief.interval
    assert high / low > 2.0


def test_a_bar_never_touched_at_its_ends_is_not_called_short() -> None:
    stand, nominal = stand_of("wrench")
    middle = np.flatnonzero((np.abs(stand.points[:, 0]) < 0.15 * nominal) & (stand.normals[:, 2] > -0.3))
    random, patches = np.random.default_rng(1), []
    for index in random.choice(middle, 8, replace=False):
        near = np.argsort(np.linalg.norm(stand.points - stand.points[index], axis=1))[:POINTS]
        facing = near[(stand.normals[near] @ stand.normals[index]) > 0.7]
        patches.append(Patch(stand.points[np.resize(facing, POINTS)] + PLACE, stand.normals[index]))
    low, high = by_touch(stand, patches, nominal, RANGE).belief.interval
    assert low < nominal < high


def test_a_way_through_the_object_counts_against_its_being_there() -> None:
    """The gel has passed beside a small tray, and would have had to pass through a large one."""
    stand, nominal = stand_of("tray")
    aside = PLACE + np.array([0.75 * nominal, 0.0, 0.0])
    way = aside + np.linspace(0.2, 0.001, 140)[:, None] * UP
    small, large = np.zeros(UNKNOWNS), np.zeros(UNKNOWNS)
    large[0] = np.log(2.0)
    both = np.stack([small, large])
    assert FreeSpace(stand, [way]).cost(both).tolist() == [0.0, THROUGH]
    assert FreeSpace(stand, [way, way]).cost(both).tolist() == [0.0, 2.0 * THROUGH]
    assert FreeSpace(stand, []).cost(both).tolist() == [0.0, 0.0]


@pytest.mark.parametrize("name", ["bowl", "pitcher", "wrench"])
def test_free_space_is_looked_up_no_farther_than_the_object_is_deep_and_costs_the_same(name: str) -> None:
    stand, _ = stand_of(name)
    random = np.random.default_rng(0)
    ways = [
        PLACE + random.uniform(-0.15, 0.15, (1, 3)) + np.linspace(0.0, 0.1, 12)[:, None] * UP
        for _ in range(60)
    ]
    some = np.zeros((6, UNKNOWNS))
    some[:, 0] = np.linspace(-0.5, 0.7, 6)
    everywhere = replace(stand)
    everywhere.__dict__["deepest"] = np.inf
    costs = FreeSpace(stand, ways).cost(some)
    assert costs.tolist() == FreeSpace(everywhere, ways).cost(some).tolist()
    assert costs.max() > 0.0
    assert stand.deepest < 0.5 * np.ptp(stand.points, axis=0).max()


@pytest.mark.parametrize("scale", [pytest.param(0.35, marks=pytest.mark.slow), 2.6])
def test_a_size_beyond_the_range_is_named(scale: float) -> None:
    stand, nominal = stand_of("mug")
    asked = SizeRange(0.5 * nominal, 2.0 * nominal)
    found = by_touch(stand, contacts("mug", scale, 10), nominal, asked)
    assert found.belief.outside > 0.5


def test_another_object_is_refused() -> None:
    stand, nominal = stand_of("wrench")
    with pytest.raises(FitRefused, match=r"6\.8 .*3\.5"):
        by_touch(stand, contacts("pitcher", 1.0, 12), nominal, RANGE)


@pytest.mark.slow  # 16 answers of several levels
def test_refining_more_places_never_costs_the_answer() -> None:
    stand, nominal = stand_of("mug")
    patches = contacts("mug", 1.3, 8)
    for starts in (4, 12, 40):
        found = by_touch(stand, patches, nominal, RANGE, starts)
        assert found.belief.size == pytest.approx(1.3 * nominal, rel=0.03)


def ball_press(radius: float, depth: float, pitch: float) -> FloatArray:
    rows, columns = np.mgrid[-60:61, -80:81] * pitch
    return np.asarray(np.maximum(depth - (rows**2 + columns**2) / (2.0 * radius), 0.0))


def test_a_press_becomes_places_on_the_surface_with_its_normal() -> None:
    pitch, base = 1e-4, transform(rotation_about(np.array([1.0, 0.0, 0.0]), np.pi), np.array([0.1, 0.2, 0.3]))
    patch = patch_of(ball_press(5e-3, 0.8e-3, pitch), pitch, base)
    assert patch is not None
    assert patch.points.shape == (POINTS, 3)
    assert patch.normal @ UP > 0.99  # the gel points down, so the surface looks up
    assert patch.points[:, 2].max() == pytest.approx(0.3 + 0.8e-3, abs=1e-4)


def test_an_untouched_gel_is_no_contact() -> None:
    assert patch_of(np.zeros((120, 160)), 1e-4, np.eye(4)) is None
