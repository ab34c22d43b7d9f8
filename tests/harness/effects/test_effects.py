"""Effects on demand: the plan says what runs and why, and exactly the plan runs, once."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.basics.errors import WrongUse
from harness.basics.store import Store
from harness.bench.scene import scene_from_options
from harness.bench.sensor import GELSIGHT_R15
from harness.effects.accuracy import Accuracy, Knob, Level
from harness.effects.effect import Condition, Effect, Facts, build_catalogue, knobs_of
from harness.effects.evaluate import Evaluation, evaluate
from harness.effects.plan import Plan, default_accuracy, plan
from harness.effects.quantities import Quantities

FACTS = Facts(scene_from_options("builtin:mug"), GELSIGHT_R15)
NEVER = Condition(lambda _: False, "it is so", "it is not so")
ALWAYS = Condition(lambda _: True, "it is so", "it is not so")
FACTOR = Knob("b", (1, 2, 3), "", "number", 2)


class Toy(Quantities, total=False):
    """Quantities of these tests."""

    x: Any
    y: Any
    a: Any
    b: Any
    c: Any
    d: Any


def chain(compute: Callable[[str, Any], Any], when: Condition | None = None) -> tuple[Effect, ...]:
    """``a`` of the source ``x``; ``b`` of ``a``; ``c`` of ``b``; and ``d`` of ``x``, which nobody needs."""

    def of_x(x: Any) -> Any:
        return compute("a", x)

    def of_a(a: Any, *, b: int) -> Any:
        return compute("b", a * b)

    def of_b(b: Any) -> Any:
        return compute("c", b)

    return build_catalogue(
        Effect("a", of_x),
        Effect("b", of_a, when=when, bypass="a", knobs=(FACTOR,)),
        Effect("c", of_b),
        Effect("d", of_x),
        quantities=Toy,
    )


def add_one(_name: str, value: Any) -> Any:
    return value + 1


def run(effects: tuple[Effect, ...], *wanted: str, x: Any = 1.0, store: Store | None = None) -> Evaluation:
    return evaluated(plan(effects, FACTS, wanted, default_accuracy(effects)), x, store)


def evaluated(made: Plan, x: Any, store: Store | None = None) -> Evaluation:
    return evaluate(made, Toy(x=x), store)


def value(done: Evaluation, name: str) -> Any:
    return done[name]


def test_only_what_is_wanted_is_planned_with_everything_it_needs() -> None:
    effects = chain(add_one)
    made = plan(effects, FACTS, ["b"], default_accuracy(effects))
    assert [step.effect.provides for step in made.ran] == ["a", "b"]
    assert made.sources == ("x",)
    assert {s.effect.provides: s.reason for s in made.skipped} == {
        "c": "nothing asked for c",
        "d": "nothing asked for d",
    }
    assert [step.reason for step in made.ran] == ["b needs it", "it is asked for"]


def test_exactly_the_plan_runs_and_each_effect_once() -> None:
    count: Counter[str] = Counter()

    def counted(name: str, value: Any) -> Any:
        count[name] += 1
        return value + 1

    done = run(chain(counted), "c", "b", "c")
    assert count == {"a": 1, "b": 1, "c": 1} == dict(done.calls)
    assert done["c"] == (1 + 1) * 2 + 1 + 1
    assert set(done.seconds) == {"a", "b", "c"}
    assert all(seconds >= 0.0 for seconds in done.seconds.values())


def test_a_bypassed_effect_is_passed_through_and_says_so() -> None:
    effects = chain(add_one, NEVER)
    made = plan(effects, FACTS, ["c"], default_accuracy(effects))
    done = evaluated(made, 1.0)
    assert dict(done.calls) == {"a": 1, "c": 1}
    assert done["b"] is done["a"]
    assert done["c"] == 3.0
    reasons = {s.effect.provides: s.reason for s in made.skipped}
    assert reasons["b"] == "it is not so; a passes through"


def test_an_effect_that_the_scene_calls_for_says_so() -> None:
    effects = chain(add_one, ALWAYS)
    made = plan(effects, FACTS, ["c"], default_accuracy(effects))
    assert [s.reason for s in made.ran if s.effect.provides == "b"] == ["c needs it; it is so"]
    assert made.ran[1].levels == {"b": 2}


def test_an_effect_the_scene_rules_out_gives_that_reason_even_if_nobody_asked() -> None:
    effects = chain(add_one, NEVER)
    made = plan(effects, FACTS, ["a"], default_accuracy(effects))
    assert {s.effect.provides: s.reason for s in made.skipped}["b"] == "it is not so"


def test_asking_for_what_the_scene_rules_out_is_refused() -> None:
    effects = (Effect("a", lambda x: x, when=NEVER), Effect("b", lambda a: a))
    with pytest.raises(WrongUse, match=r"^a .*it is not so"):
        run(effects, "a")
    with pytest.raises(WrongUse, match=r"b .*a, .*it is not so"):
        run(effects, "b")


def test_asking_for_what_nothing_computes_names_the_nearest() -> None:
    effects = (Effect("touch.image", lambda x: x),)
    with pytest.raises(WrongUse, match=r"'touch.imgae'.*'touch.image'"):
        run(effects, "touch.imgae")


def test_a_missing_source_is_named_before_anything_is_computed() -> None:
    def never(_name: str, _value: Any) -> Any:
        raise AssertionError("computed")

    effects = chain(never)
    with pytest.raises(WrongUse, match="x: "):
        evaluate(plan(effects, FACTS, ["c"], default_accuracy(effects)), {})


def test_a_circle_is_refused_and_spelled_out() -> None:
    effects = (
        Effect("a", lambda b: b),
        Effect("b", lambda c: c),
        Effect("c", lambda b: b),
    )
    with pytest.raises(ValueError, match=r"b .*c .*b"):
        run(effects, "a")


def test_two_homes_for_a_quantity_and_a_foreign_bypass_are_refused() -> None:
    one = Effect("a", lambda x: x)
    with pytest.raises(ValueError, match=r"two .*\ba\b"):
        build_catalogue(one, one)
    with pytest.raises(ValueError, match=r"\by\b"):
        build_catalogue(replace(one, bypass="y"))


@dataclass(frozen=True)
class Pair:
    array: np.ndarray[Any, np.dtype[np.float64]]


def test_arrays_that_leave_an_effect_cannot_be_written_and_sources_stay_writable() -> None:
    source = np.ones(3)
    effects = (
        Effect("a", lambda x: x),
        Effect("b", lambda x: (x + 1, {"k": x + 2})),
        Effect("c", lambda x: Pair(x + 3)),
    )
    done = run(effects, "a", "b", "c", x=source)
    for array in (value(done, "a"), value(done, "b")[0], value(done, "b")[1]["k"], value(done, "c").array):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 5.0
    with pytest.raises(TypeError):
        done.values["seed"] = 1
    source[0] = 7.0
    assert source[0] == 7.0


def test_the_leading_batch_axis_is_carried_through() -> None:
    batch = np.arange(12.0).reshape(4, 3)
    whole = value(run(chain(add_one), "c", x=batch), "c")
    each = [value(run(chain(add_one), "c", x=batch[i : i + 1]), "c")[0] for i in range(4)]
    assert np.array_equal(whole, np.array(each))


def stored(effects: tuple[Effect, ...], *names: str) -> tuple[Effect, ...]:
    return tuple(replace(effect, stored=effect.provides in names) for effect in effects)


@settings(deadline=None, max_examples=20)
@given(st.sets(st.sampled_from(["a", "b", "c"])), st.sampled_from([1, 2, 3]), st.booleans())
def test_a_store_changes_no_result(
    tmp_path_factory: pytest.TempPathFactory, names: set[str], level: int, bypassed: bool
) -> None:
    effects = stored(chain(add_one, NEVER if bypassed else None), *names)
    accuracy = Accuracy(knobs_of(effects), {"b": level})
    made = plan(effects, FACTS, ["c"], accuracy)
    x = np.linspace(0.0, 1.0, 5)
    store = Store(tmp_path_factory.mktemp("store"))
    without = evaluated(made, x)
    for _ in range(3):
        assert np.array_equal(value(evaluated(made, x, store), "c"), value(without, "c"))


def test_a_stored_result_is_read_and_what_only_it_needed_is_not_computed(tmp_path: Path) -> None:
    effects = stored(chain(add_one), "b")
    x = np.ones(2)
    first = run(effects, "c", x=x, store=Store(tmp_path))
    second = run(effects, "c", x=x, store=Store(tmp_path))
    assert (dict(first.calls), first.from_store) == ({"a": 1, "b": 1, "c": 1}, ())
    assert (dict(second.calls), second.from_store) == ({"c": 1}, ("b",))
    with pytest.raises(ValueError, match="read-only"):
        value(second, "b")[0] = 1.0


@pytest.mark.parametrize("change", ["source", "level", "version", "version before", "bypass"])
def test_whatever_a_result_depends_on_is_in_its_key(tmp_path: Path, change: str) -> None:
    effects = stored(chain(add_one), "c")
    store, x, level = Store(tmp_path), np.ones(2), 2
    evaluated(plan(effects, FACTS, ["c"], Accuracy(knobs_of(effects), {"b": level})), x, store)
    if change == "source":
        x = np.nextafter(x, 2.0)
    elif change == "level":
        level = 3
    elif change == "version":
        effects = (*effects[:2], replace(effects[2], version=2), effects[3])
    elif change == "version before":
        effects = (replace(effects[0], version=2), *effects[1:])
    else:
        effects = (effects[0], replace(effects[1], when=NEVER), *effects[2:])
    again = evaluated(plan(effects, FACTS, ["c"], Accuracy(knobs_of(effects), {"b": level})), x, store)
    assert again.calls["c"] == 1


def test_a_knob_downstream_does_not_disturb_what_is_stored_upstream(tmp_path: Path) -> None:
    effects = stored(chain(add_one), "a")
    store, x = Store(tmp_path), np.ones(2)
    for level in (1, 2, 3):
        made = plan(effects, FACTS, ["c"], Accuracy(knobs_of(effects), {"b": level}))
        done = evaluated(made, x, store)
        assert ("a" in done.calls) == (level == 1)


def test_a_supplied_quantity_takes_the_place_of_its_effect(tmp_path: Path) -> None:
    effects, store = stored(chain(add_one, NEVER), "c"), Store(tmp_path)
    made = plan(effects, FACTS, ["c"], default_accuracy(effects), ["b"])
    assert ([step.effect.provides for step in made.ran], made.sources) == (["c"], ("b",))
    assert [step.effect.provides for step in made.skipped] == ["a", "d"]
    for b, times in ((5.0, 1), (5.0, 0), (6.0, 1)):
        done = evaluate(made, Toy(b=np.full(1, b)), store)
        assert (value(done, "c").item(), done.calls.get("c", 0)) == (b + 1.0, times)
    unplanned = evaluate(
        plan(chain(add_one), FACTS, ["c"], default_accuracy(effects)), Toy(x=1.0, b=np.array(5.0))
    )
    assert (float(value(unplanned, "c")), dict(unplanned.calls)) == (6.0, {"c": 1})


def test_a_parameter_with_a_default_is_a_source_that_may_be_left_out() -> None:
    effects = (Effect("a", lambda x, y=10.0: x + y),)
    without = plan(effects, FACTS, ["a"], default_accuracy(effects))
    made = plan(effects, FACTS, ["a"], default_accuracy(effects), ["x", "y"])
    assert (without.sources, made.sources) == (("x",), ("x", "y"))
    assert value(evaluate(without, Toy(x=1.0)), "a") == 11.0
    assert value(evaluate(made, Toy(x=1.0, y=2.0)), "a") == 3.0


HOW = Knob("how", ("guess", "table", "exact"), "", "method", "exact")


def with_ways(guess: Condition | None = ALWAYS, version: int = 1) -> tuple[Effect, ...]:
    """``a`` of ``x``; or guessed, of ``y``; or out of a table, of both; and ``b`` of ``a``."""
    ways: dict[Level, Effect] = {
        "guess": Effect("a", lambda y: -y, when=guess),
        "table": Effect("a", lambda x, y, *, b: x * b, knobs=(FACTOR,), version=version),
    }
    return (
        Effect("a", lambda x: x, choice=HOW, ways=ways),
        Effect("b", lambda a: 2.0 * a, stored=True),
    )


def through(effects: tuple[Effect, ...], how: str, store: Store | None = None, b: int = 2) -> Evaluation:
    made = plan(effects, FACTS, ["b"], Accuracy((HOW, FACTOR), {"how": how, "b": b}))
    return evaluate(made, Toy(x=np.ones(2), y=np.full(2, 5.0)), store)


def test_a_level_is_a_way_with_needs_and_knobs_of_its_own() -> None:
    effects = with_ways()
    assert {how: value(through(effects, str(how)), "b")[0] for how in HOW.levels} == {
        "guess": -10.0,
        "table": 4.0,
        "exact": 2.0,
    }
    made = plan(effects, FACTS, ["b"], Accuracy(knobs_of(effects), {"how": "guess"}))
    assert made.sources == ("y",)
    assert made.ran[0].reason == "b needs it; how is guess, and it is so"
    assert made.ran[0].levels == {"how": "guess"}
    made = plan(effects, FACTS, ["b"], Accuracy(knobs_of(effects), {"how": "table"}))
    assert (made.sources, dict(made.ran[0].levels)) == (("x", "y"), {"how": "table", "b": 2})
    assert made.ran[0].reason == "b needs it; how is table"
    made = plan(effects, FACTS, ["b"], default_accuracy(effects))
    assert made.ran[0].reason == "b needs it; how is exact, its default"


def test_a_way_whose_scene_has_not_what_it_takes_is_refused_only_where_it_would_run() -> None:
    effects = with_ways(NEVER)
    with pytest.raises(WrongUse, match=r"how = guess: it is not so.*how = exact"):
        through(effects, "guess")
    assert value(through(effects, "table"), "b")[0] == 4.0
    other = Effect("c", lambda x: x)
    guessed = Accuracy(knobs_of(effects), {"how": "guess"})
    assert plan((*effects, other), FACTS, ["c"], guessed).sources == ("x",)


def test_ways_are_told_apart_in_the_store_and_a_new_one_drops_nothing(tmp_path: Path) -> None:
    store, effects = Store(tmp_path), with_ways()
    before = (replace(effects[0], choice=None, ways={}), effects[1])
    assert through(before, "exact", store).calls["b"] == 1
    assert "b" in through(effects, "exact", store).from_store
    for how, b, version in (("guess", 2, 1), ("table", 2, 1), ("table", 3, 1), ("table", 3, 2)):
        assert through(with_ways(version=version), how, store, b).calls["b"] == 1
        assert "b" in through(with_ways(version=version), how, store, b).from_store


def test_a_way_of_no_level_is_refused() -> None:
    astray = replace(with_ways()[0], ways={"gues": Effect("a", lambda: 0.0)})
    with pytest.raises(ValueError, match=r"\ba\b.*\("):
        build_catalogue(astray)
