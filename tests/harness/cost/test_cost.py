"""What accuracy costs: the front, the choices made from it, and curves that say when they are stale."""

import itertools
import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.basics.code_version import closure, content_hash
from harness.basics.errors import DataRefused, WrongUse
from harness.cost.bounds import KEPT, likely_error, most_seconds, predicted_at_most
from harness.cost.choice import for_budget, for_error, nearest_condition
from harness.cost.curve import Curve, Point, Sample, best_within, front
from harness.cost.file import curve_path, from_json, load, save, to_json
from harness.cost.promise import doubt, doubts, promise, promise_share
from harness.cost.provenance import machine, stale
from harness.effects.accuracy import Level

CONDITION: dict[str, Level] = {"yaw": "known", "contacts": 6}
HERE = {"cpu": "a processor", "cores": "2"}
NOW = {"sha256": "ab", "git": "1234"}


def sample(
    run: str = "a", error: float = 1e-3, cpu: float = 0.1, radius: float | None = 2e-3, of: str = "mug"
) -> Sample:
    return Sample(run, of, error, radius, 0.05, cpu, 1.1 * cpu)


def point(
    name: str, cpu: float, error: float, runs: int = 5, radius: float = 2e-3, jitter: float = 0.0
) -> Point:
    spread = np.exp(jitter * np.linspace(-1.0, 1.0, runs))
    samples = tuple(sample(f"run {k}", error, cpu * float(spread[k]), radius) for k in range(runs))
    return Point(name, {"level": name}, CONDITION, samples)


costs = st.floats(1e-3, 1e2)
errors = st.floats(1e-4, 1e-1)
clouds = st.lists(st.tuples(costs, errors), min_size=1, max_size=12).map(
    lambda pairs: [point(f"p{k}", cost, error, runs=2) for k, (cost, error) in enumerate(pairs)]
)


def dominates(a: Point, b: Point) -> bool:
    better = a.seconds.value <= b.seconds.value and a.error.value <= b.error.value
    return better and (a.seconds.value < b.seconds.value or a.error.value < b.error.value)


def test_a_failure_counts_as_a_failure_however_far_off_it_is() -> None:
    near = Point("p", {}, CONDITION, (sample("a", 1e-3), sample("b", 20e-3)))
    far = Point("p", {}, CONDITION, (sample("a", 1e-3), sample("b", 0.3)))
    assert near.error.value == far.error.value == pytest.approx(10.5e-3)


@settings(deadline=None)
@given(clouds)
def test_no_point_dominates_one_of_the_front_and_each_other_is_dominated_or_equalled(
    cloud: list[Point],
) -> None:
    best = front(cloud)
    assert not any(dominates(a, b) for a in cloud for b in best)
    for other in set(cloud) - set(best):
        assert any(
            p.seconds.value <= other.seconds.value and p.error.value <= other.error.value for p in best
        )


@settings(deadline=None)
@given(clouds)
def test_the_front_falls_in_error_as_it_rises_in_seconds(cloud: list[Point]) -> None:
    best = front(cloud)
    for cheap, dear in itertools.pairwise(best):
        assert cheap.seconds.value < dear.seconds.value
        assert cheap.error.value > dear.error.value


@settings(deadline=None)
@given(clouds, costs, costs)
def test_a_larger_budget_never_buys_a_larger_error(cloud: list[Point], a: float, b: float) -> None:
    less, more = best_within(cloud, min(a, b)), best_within(cloud, max(a, b))
    if less is not None:
        assert more is not None
        assert more.error.value <= less.error.value
        assert less.seconds.value <= min(a, b)


@settings(deadline=None)
@given(clouds, costs)
def test_what_a_budget_buys_lies_on_the_front(cloud: list[Point], budget: float) -> None:
    bought = best_within(cloud, budget)
    if bought is not None:
        assert any(
            bought.error.value == p.error.value and bought.seconds.value >= p.seconds.value
            for p in front(cloud)
        )


@pytest.mark.parametrize("odd", [math.nan, math.inf, -1.0])
@pytest.mark.parametrize("name", ["error", "radius", "shared", "cpu", "wall"])
def test_a_number_that_cannot_be_is_refused(name: str, odd: float) -> None:
    with pytest.raises(WrongUse, match=r"radius .*finite"):
        replace(sample(), **{name: odd})  # type: ignore[arg-type]  # the point of the test


def test_an_answer_in_no_time_was_not_measured() -> None:
    with pytest.raises(WrongUse, match="0 s"):
        replace(sample(), cpu=0.0)


@pytest.mark.parametrize("odd", [0.0, -1.0, math.nan, math.inf])
def test_a_budget_or_error_that_cannot_be_kept_is_refused(odd: float) -> None:
    with pytest.raises(WrongUse, match="budget"):
        best_within([point("p", 1.0, 1e-3)], odd)


def test_a_run_is_counted_once_at_each_setting() -> None:
    with pytest.raises(WrongUse, match="2 samples of 1 runs"):
        Point("p", {}, CONDITION, (sample("a"), sample("a")))
    with pytest.raises(WrongUse, match="0 samples"):
        Point("p", {}, CONDITION, ())


def test_the_bound_on_the_next_run_holds_as_often_as_it_says() -> None:
    rng = np.random.default_rng(5)
    draws = np.exp(0.4 * rng.standard_normal((4000, 6)))
    held = np.mean([draw[5] <= predicted_at_most(draw[:5], 0.95) for draw in draws])
    assert held == pytest.approx(0.95, abs=0.012)  # 3.5 standard errors of 4000 draws


def test_a_bound_needs_more_than_one_run() -> None:
    with pytest.raises(WrongUse, match="1 values"):
        predicted_at_most(np.array([1.0]))


def claiming(errors_: np.ndarray, radii: np.ndarray | None = None) -> Point:
    claimed = np.ones(len(errors_)) if radii is None else radii
    pairs = enumerate(zip(errors_, claimed, strict=True))
    return Point("p", {}, CONDITION, tuple(sample(str(k), float(e), radius=float(r)) for k, (e, r) in pairs))


def test_a_promise_is_met_as_often_as_it_says_whatever_the_tail() -> None:
    rng = np.random.default_rng(3)
    met = []
    for _ in range(1500):
        errors_ = np.abs(rng.standard_cauchy(40)) + 1e-6
        met.append(errors_[-1] <= promise(claiming(errors_[:-1]), 1.0, "mug", 0.95))
    assert np.mean(met) >= 0.95 - 0.02
    assert np.mean(met) <= 1.0 - 0.02


def test_a_promise_made_only_to_the_sure_is_met_by_them_though_some_are_wrong_and_sure() -> None:
    rng = np.random.default_rng(4)
    met = []
    for _ in range(600):
        radii = np.exp(rng.normal(0.0, 1.0, 61))
        errors_ = 0.5 * radii * np.abs(rng.standard_normal(61))
        wrong = rng.random(61) < 0.03  # at any radius: among the surest too
        errors_ = np.where(wrong, 50.0, errors_) + 1e-6
        known, sure = claiming(errors_[:-1], radii[:-1]), float(radii[-1])
        for wanted in (1.0, 2.0, 4.0):
            if promise(known, sure, "mug", 0.95) <= wanted:
                met.append(errors_[-1] <= wanted)
    assert len(met) > 200
    assert np.mean(met) >= 0.95 - 0.015


def test_the_surer_are_promised_no_more_error_and_the_least_sure_nothing() -> None:
    radii = np.linspace(1.0, 4.0, 60)
    known = claiming(radii**2, radii)
    promised = [promise(known, float(radius), "mug", 0.95) for radius in np.linspace(0.5, 4.0, 30)]
    assert promised == sorted(promised)
    assert promised[0] < 0.6 * promised[-1]
    assert promise(known, 4.1, "mug", 0.95) == math.inf


def on_two_objects(of_mug: float, of_plate: float, runs: int = 30) -> Point:
    """A setting that claims the same of both and errs on one."""
    samples = [sample(f"mug {k}", of_mug * (1.0 + 0.01 * k)) for k in range(runs)]
    samples += [sample(f"plate {k}", of_plate * (1.0 + 0.01 * k), of="plate") for k in range(runs)]
    return Point("p", {}, CONDITION, tuple(samples))


def test_what_errs_on_an_object_is_not_promised_there_though_it_claims_as_much_everywhere() -> None:
    known = on_two_objects(1e-3, 8e-3)
    assert promise(known, 2e-3, "mug") < 2e-3
    assert promise(known, 2e-3, "plate") > 8e-3
    assert promise_share(known, "mug", 2e-3) == 1.0
    assert promise_share(known, "plate", 2e-3) == 0.0
    assert doubt(known, 2e-3, "mug") < doubt(known, 2e-3, "a stranger") < doubt(known, 2e-3, "plate")


def test_a_measured_run_does_not_vouch_for_itself() -> None:
    known = on_two_objects(1e-3, 1e-3)
    wrong = replace(known.samples[0], error=15e-3)
    told = replace(known, samples=(wrong, *known.samples[1:]))
    own, others = doubts(told, [wrong]), doubts(known, [known.samples[0]])
    assert own == pytest.approx(others, rel=1e-9)
    assert doubt(told, 2e-3, "mug") > doubt(known, 2e-3, "mug")


def test_promises_by_an_object_s_record_are_met_as_often_as_they_say() -> None:
    """Objects that a setting errs on more or less, and claims that say little of it."""
    rng, met = np.random.default_rng(5), []
    for _ in range(400):
        hard = np.exp(rng.normal(0.0, 0.7, 6)) * 1e-3
        which = np.append(np.repeat(np.arange(6), 10), rng.integers(6))
        errors_ = hard[which] * np.abs(rng.standard_normal(61)) + 1e-6
        radii = hard[which] ** 0.3 * np.exp(rng.normal(0.0, 0.3, 61))
        runs = [
            sample(str(k), float(errors_[k]), radius=float(radii[k]), of=str(which[k])) for k in range(60)
        ]
        known = Point("p", {}, CONDITION, tuple(runs))
        for wanted in (1e-3, 2e-3, 4e-3):
            if promise(known, float(radii[-1]), str(which[-1])) <= wanted:
                met.append(errors_[-1] <= wanted)
    assert len(met) > 200
    assert np.mean(met) >= 0.95 - 0.02


def test_too_few_runs_promise_nothing() -> None:
    assert promise(claiming(np.full(18, 1e-3)), 1.0, "mug", 0.95) == math.inf
    assert promise(claiming(np.full(19, 0.5)), 1.0, "mug", 0.95) == 0.5
    assert promise(claiming(np.full(18, 0.5)), 1.0, "mug") == math.inf
    assert promise(claiming(np.full(19, 0.5)), 1.0, "mug") == 0.5
    assert promise_share(claiming(np.full(18, 1e-3)), "mug", 1.0) == 0.0
    assert promise_share(claiming(np.full(19, 1e-3)), "mug", 1.0) == 1.0


def test_a_refused_answer_promises_nothing_and_counts_as_no_claim() -> None:
    known = claiming(np.full(40, 0.5))
    refused = replace(known.samples[0], run="refused", radius=None)
    more = replace(known, samples=(*known.samples, refused))
    assert promise(more, 1.0, "mug") == 0.5
    assert promise_share(more, "mug", 1.0) == pytest.approx(40 / 41)


def test_a_budget_takes_the_best_that_keeps_it_in_nearly_every_run() -> None:
    steady, wild = point("steady", 0.5, 2e-3, jitter=0.02), point("wild", 0.5, 1e-3, jitter=1.0)
    assert for_budget([steady, wild], 1.0, None).point is steady
    assert for_budget([steady, wild], 1e4, None).point is wild


def test_a_slower_machine_buys_less_and_time_already_spent_counts() -> None:
    cheap, dear = point("cheap", 0.1, 2e-3, jitter=0.01), point("dear", 0.4, 1e-3, jitter=0.01)
    assert for_budget([cheap, dear], 0.6, None).point is dear
    assert for_budget([cheap, dear], 0.6, None, speed=2.0).point is cheap
    assert for_budget([cheap, dear], 0.6, None, spent=0.4).point is cheap


def test_a_budget_below_everything_takes_the_cheapest_and_says_that_it_does_not_fit() -> None:
    found = for_budget([point("cheap", 0.1, 2e-3), point("dear", 0.4, 1e-3)], 1e-3, None)
    assert found.point.name == "cheap"
    assert not found.fits
    assert found.seconds > 1e-3


def test_an_object_that_was_measured_goes_by_its_own_seconds() -> None:
    mixed = tuple(sample(f"m{k}", cpu=0.1 + 1e-3 * k) for k in range(5)) + tuple(
        sample(f"p{k}", cpu=2.0 + 1e-2 * k, of="plate") for k in range(5)
    )
    one = Point("p", {}, CONDITION, mixed)
    assert for_budget([one], 0.3, "mug").fits
    assert not for_budget([one], 0.3, "plate").fits
    assert not for_budget([one], 0.3, "something else").fits


def of_two(name: str, on_mug: float, on_tray: float, runs: int = 30) -> Point:
    """A setting with an error on each of two objects."""
    errors = {"mug": on_mug, "tray": on_tray}
    samples = tuple(sample(f"{o} {k}", error, of=o) for o, error in errors.items() for k in range(runs))
    return Point(name, {"level": name}, CONDITION, samples)


def test_a_budget_takes_what_is_best_on_the_object_at_hand() -> None:
    touch, sound = of_two("touch", 1e-3, 15e-3), of_two("sound", 4e-3, 4e-3)
    assert for_budget([touch, sound], 10.0, "mug").point is touch
    assert for_budget([touch, sound], 10.0, "tray").point is sound
    assert for_budget([touch, sound], 10.0, "a stranger").point is sound


@settings(deadline=None)
@given(errors, errors, st.integers(1, 200))
def test_an_object_s_own_runs_count_the_more_the_more_there_are(mug: float, tray: float, runs: int) -> None:
    few, many = of_two("p", mug, tray, runs), of_two("p", mug, tray, runs + 1)
    assert likely_error(few, None) == likely_error(few, "a stranger") == pytest.approx(few.error.value)
    own = min(tray, 20e-3)
    assert abs(likely_error(many, "tray") - own) <= abs(likely_error(few, "tray") - own) + 1e-15


def test_the_spread_within_objects_is_learnt_from_all_of_them() -> None:
    rng = np.random.default_rng(8)
    held = []
    for _ in range(1500):
        means = np.exp(rng.normal(0.0, 1.5, 6))
        cpus = means[:, None] * np.exp(rng.normal(0.0, 0.3, (6, 4)))
        known = tuple(
            sample(f"{o}-{k}", cpu=float(cpus[o, k]), of=str(o)) for o in range(6) for k in range(3)
        )
        held.append(cpus[2, 3] <= most_seconds(Point("p", {}, CONDITION, known), "2", spent=0.0))
    assert np.mean(held) == pytest.approx(KEPT, abs=0.015)  # 3.7 standard errors of 1500 draws


def test_a_steady_object_is_not_priced_by_a_wild_one_nor_the_other_way_round() -> None:
    rng = np.random.default_rng(9)
    held: dict[str, list[bool]] = {"steady": [], "wild": []}
    reach = []
    for _ in range(800):
        known, after = [], {}
        for name, spread in (("steady", 0.1), ("fair", 0.25), ("also fair", 0.3), ("wild", 0.9)):
            cpus = np.exp(rng.normal(0.0, spread, 11))
            known += [sample(f"{name}-{k}", cpu=float(cpus[k]), of=name) for k in range(10)]
            after[name] = float(cpus[10])
        one = Point("p", {}, CONDITION, tuple(known))
        for name, those in held.items():
            those.append(after[name] <= most_seconds(one, name, spent=0.0))
        reach.append(most_seconds(one, "steady", spent=0.0))
    assert np.mean(held["wild"]) >= 0.95
    assert np.mean(held["steady"]) >= 0.97
    assert np.median(reach) < 1.6  # all spreads taken as one would be 2.8


def test_an_error_is_tried_cheaply_first_where_that_pays() -> None:
    coarse = point("coarse", 0.1, 2e-3, runs=40, radius=3e-3)
    fine = point("fine", 2.0, 0.5e-3, runs=40, radius=1e-3)
    assert for_error([coarse, fine], 5e-3, None)[0] is coarse
    assert [p.name for p in for_error([coarse, fine], 1e-3, None)] == ["fine"]


def test_an_error_that_nothing_promises_takes_what_promises_most() -> None:
    coarse = point("coarse", 0.1, 2e-3, runs=40)
    fine = point("fine", 2.0, 0.5e-3, runs=40, radius=1e-3)
    assert [p.name for p in for_error([coarse, fine], 1e-5, None)] == ["fine"]


def test_fewer_contacts_than_the_run_has_are_gone_by_and_seconds_grow_with_them() -> None:
    measured = [{**CONDITION, "contacts": count} for count in (2, 4, 6)]
    assert nearest_condition(measured, {**CONDITION, "contacts": 5}, "contacts") == (measured[1], 1.25)
    assert nearest_condition(measured, {**CONDITION, "contacts": 12}, "contacts") == (measured[2], 2.0)
    assert nearest_condition(measured, {**CONDITION, "contacts": 1}, "contacts") == (measured[0], 0.5)
    with pytest.raises(WrongUse, match="yaw unknown"):
        nearest_condition(measured, {"yaw": "unknown", "contacts": 6}, "contacts")


def curve() -> Curve:
    return Curve(
        "test", (point("a", 0.1, 2e-3), point("b", 0.3, 1e-3)), HERE, NOW, "2026-01-01T00:00:00+00:00", "T"
    )


def test_a_curve_is_stale_when_the_machine_or_the_code_changes_and_only_then() -> None:
    assert stale(curve(), HERE, NOW) == ()
    assert stale(curve(), HERE, {**NOW, "git": "another commit"}) == ()
    assert any("cores was 2, is 4" in reason for reason in stale(curve(), {**HERE, "cores": "4"}, NOW))
    assert any("1234" in reason for reason in stale(curve(), HERE, {**NOW, "sha256": "cd"}))


def test_a_curve_comes_back_from_the_disk_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "new" / "curve.json"
    save(curve(), path)
    again = load(path)
    assert to_json(again) == to_json(curve())
    for one, other in zip(again.points, curve().points, strict=True):
        assert [s.run for s in one.samples] == [s.run for s in other.samples]
        np.testing.assert_allclose(one.cpu_seconds, other.cpu_seconds, rtol=1e-4)
        np.testing.assert_allclose(one.errors, other.errors, rtol=1e-4)


def test_curves_are_kept_where_the_cache_is_by_machine(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TOUCHSTONE_CACHE", str(tmp_path))
    assert curve_path("p", HERE).is_relative_to(tmp_path)
    assert curve_path("p", HERE) != curve_path("p", {**HERE, "cores": "4"})
    assert curve_path("p") == curve_path("p", machine())


def broken(change: str) -> str:
    tree = to_json(curve())
    one = tree["points"][0]
    if change == "nan":
        one["error_m"][0] = math.nan
    elif change == "negative":
        one["cpu_s"][0] = -1.0
    elif change == "key":
        one["errors_m"] = one.pop("error_m")
    elif change == "column":
        one["error_m"].pop()
    elif change == "run":
        one["runs"][0] = len(tree["runs"])
    elif change == "schema":
        tree["schema"] = 99
    elif change == "list":
        return "[]"
    return json.dumps(tree)[: -40 if change == "cut" else None]


@pytest.mark.parametrize("change", ["nan", "negative", "key", "column", "run", "schema", "list", "cut"])
def test_a_damaged_curve_is_refused_by_name(tmp_path: Path, change: str) -> None:
    path = tmp_path / "curve.json"
    path.write_text(broken(change))
    with pytest.raises(DataRefused, match=r"curve\.json"):
        load(path)


def test_an_untouched_curve_is_not_refused() -> None:
    assert from_json(json.loads(broken("nothing"))).program == "test"


def test_the_code_of_a_module_is_all_that_it_imports_of_ours() -> None:
    found = closure("harness.cost.choice")
    assert {
        "harness.cost.curve",
        "harness.cost.bounds",
        "harness.effects.accuracy",
        "harness.basics.metrics",
    } <= found
    assert not any(name.startswith("numpy") for name in found)
    assert content_hash("harness.cost.curve") != content_hash("harness.cost.bounds")
    assert content_hash("harness.cost.curve") == content_hash("harness.cost.curve")
