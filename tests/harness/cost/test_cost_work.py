"""Seconds that grow with what a run shows there is to do: one slope for all objects, a level for each."""

from collections.abc import Mapping, Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.basics.errors import WrongUse
from harness.cost.bounds import KEPT, lines, most_seconds
from harness.cost.curve import Curve, Point, Sample
from harness.cost.file import from_json, to_json

OBJECTS = {"mug": 0.02, "tray": 0.05, "pitcher": 0.03}
"""s that one place takes, by object."""


def measured(works: Mapping[str, Sequence[float | None]], seconds: Mapping[str, Sequence[float]]) -> Point:
    samples = tuple(
        Sample(f"{name} {k}", name, 1e-3, 2e-3, 0.0, cpu, cpu, work)
        for name in works
        for k, (work, cpu) in enumerate(zip(works[name], seconds[name], strict=True))
    )
    return Point("p", {}, {}, samples)


def drawn(power: float, noise: float, runs: int = 10, seed: int = 0) -> Point:
    """Runs whose seconds go as a power of their work, which differs up to twentyfold within an object."""
    rng = np.random.default_rng(seed)
    works = {name: np.exp(rng.uniform(0.0, 3.0, runs)) for name in OBJECTS}
    seconds = {
        name: OBJECTS[name] * works[name] ** power * np.exp(noise * rng.standard_normal(runs))
        for name in OBJECTS
    }
    return measured({name: list(w) for name, w in works.items()}, {n: list(s) for n, s in seconds.items()})


@settings(deadline=None, max_examples=50)
@given(power=st.floats(0.0, 1.0), seed=st.integers(0, 100))
def test_a_power_of_the_work_is_found_exactly(power: float, seed: int) -> None:
    found = lines(drawn(power, 0.0, seed=seed), by_work=True)
    assert found.slope == pytest.approx(power, abs=1e-9)
    for line in found.of.values():
        np.testing.assert_allclose(line.rest, 0.0, atol=1e-9)


@pytest.mark.parametrize(("power", "slope"), [(-0.5, 0.0), (1.7, 1.0)])
def test_seconds_neither_fall_with_work_nor_outgrow_it(power: float, slope: float) -> None:
    assert lines(drawn(power, 0.0), by_work=True).slope == slope


def test_without_work_lines_are_level_at_the_mean() -> None:
    point = drawn(0.5, 0.1)
    found = lines(point, by_work=False)
    assert found.slope == found.squares == 0.0
    for name, line in found.of.items():
        own = [np.log(s.cpu) for s in point.samples if s.object == name]
        assert line.seconds == pytest.approx(np.mean(own))
        np.testing.assert_allclose(line.rest, own - np.mean(own), atol=1e-12)


def test_one_run_without_work_makes_all_lines_level() -> None:
    works: dict[str, list[float | None]] = {"mug": [1.0, 2.0, None], "tray": [1.0, 4.0, 9.0]}
    point = measured(works, {"mug": [1.0, 2.0, 3.0], "tray": [1.0, 4.0, 9.0]})
    assert lines(point, by_work=True).slope == 0.0
    assert most_seconds(point, "tray", work=5.0) == most_seconds(point, "tray")


def test_the_same_work_in_every_run_says_nothing() -> None:
    works: dict[str, list[float | None]] = {"mug": [3.0] * 5, "tray": [7.0] * 5}
    point = measured(works, {name: [1.0, 1.1, 0.9, 1.2, 1.0] for name in works})
    assert most_seconds(point, "mug", work=1e6) == most_seconds(point, "mug")


@settings(deadline=None, max_examples=50)
@given(seed=st.integers(0, 100), one=st.floats(1.0, 20.0), other=st.floats(1.0, 20.0))
def test_the_mean_grows_with_work(seed: int, one: float, other: float) -> None:
    found = lines(drawn(0.6, 0.1, seed=seed), by_work=True)
    assert found.slope > 0.0
    low, high = min(one, other), max(one, other)
    assert found.slope * np.log(low) <= found.slope * np.log(high)


def test_far_from_what_was_measured_the_bound_is_wider_than_the_line() -> None:
    """Nothing was measured there: what is not known of the slope counts more and more."""
    point = drawn(0.5, 0.1)
    ratios = [most_seconds(point, "mug", work=work) / work**0.5 for work in (5.0, 50.0, 500.0, 5e4)]
    assert ratios == sorted(ratios)
    assert np.isfinite(ratios).all()


def test_the_next_run_stays_within_the_bound_as_often_as_said() -> None:
    """And the bound is the tighter for knowing the run's work."""
    rng = np.random.default_rng(1)
    kept, widths = [], []
    for seed in range(60):
        point = drawn(0.5, 0.15, seed=seed)
        for name, each in OBJECTS.items():
            work = float(np.exp(rng.uniform(0.0, 3.0)))
            bound = most_seconds(point, name, work=work)
            taken = each * work**0.5 * np.exp(0.15 * rng.standard_normal(20))
            kept.append(np.mean(taken <= bound))
            widths.append((bound / (each * work**0.5), most_seconds(point, name) / (each * work**0.5)))
    assert np.mean(kept) == pytest.approx(KEPT, abs=0.02)
    known, unknown = np.median(widths, axis=0)
    assert known < 0.7 * unknown


@pytest.mark.parametrize("work", [0.0, -1.0, float("nan"), float("inf")])
def test_work_that_cannot_be_is_refused(work: float) -> None:
    with pytest.raises(WrongUse, match="run a: work"):
        Sample("a", "mug", 1e-3, None, 0.0, 0.1, 0.1, work)


def test_work_is_kept_with_the_curve() -> None:
    point = drawn(0.5, 0.1)
    back = from_json(to_json(Curve("p", (point,), {}, {}, "now"))).points[0]
    for one, other in zip(back.samples, point.samples, strict=True):
        assert one.work == pytest.approx(other.work, rel=1e-4)
