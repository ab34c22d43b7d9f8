"""Cells are measured once, stored at once, and measured again only where what they depend on changed."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest

from experiments.paper.rendering import (
    ROUNDS,
    MadeMethod,
    MeasuredMethod,
    RenderingMethod,
    RenderingWork,
    Sense,
    TorchMissing,
    load_or_train_graph,
    measure_sense,
    time_in_turn,
)
from harness.basics.arrays import AnyArray
from harness.basics.store import Store


@dataclass(frozen=True)
class CountedBench:
    """Numbers that should be their own number."""

    identity: str = "counted"
    count: int = 3
    sense: Sense = "touch"

    def scores(self, number: int, rendered: AnyArray) -> Mapping[str, float]:
        return {"psnr_db": float(rendered) - number}


@dataclass
class Counter:
    made: int = 0
    rendered: list[int] = field(default_factory=list)

    def method(self, name: str = "counted", version: int = 1) -> RenderingMethod:
        return RenderingMethod(name, "ours", (version,), self._make)

    def _make(self) -> MadeMethod:
        self.made += 1
        return MadeMethod(self._observe, 2.5)

    def _observe(self, number: int) -> AnyArray:
        self.rendered.append(number)
        return np.array(number + 1.0)


def work(folder: Path) -> RenderingWork:
    return RenderingWork(Store(folder), lambda doing, share: None)


def measured(folder: Path, *methods: RenderingMethod) -> dict[str, MeasuredMethod]:
    return {each.method.name: each for each in measure_sense(CountedBench(), methods, work(folder))}


def test_every_query_is_scored_and_what_was_made_is_stated(tmp_path: Path) -> None:
    found = measured(tmp_path, Counter().method())["counted"]
    assert found.scores["psnr_db"].tolist() == [1.0, 1.0, 1.0]
    assert found.made == 2.5
    assert (found.seconds >= 0.0).all()
    assert len(found.seconds) >= 2


def test_a_second_table_renders_nothing_and_makes_nothing(tmp_path: Path) -> None:
    first, again = Counter(), Counter()
    one = measured(tmp_path, first.method())["counted"]
    other = measured(tmp_path, again.method())["counted"]
    assert again.made == 0
    assert again.rendered == []
    assert other.seconds.tolist() == one.seconds.tolist()


def test_only_what_changed_is_scored_again(tmp_path: Path) -> None:
    same, changed = Counter(), Counter()
    measured(tmp_path, same.method("same"), changed.method("changed"))
    same.rendered.clear()
    changed.rendered.clear()
    measured(tmp_path, same.method("same"), changed.method("changed", version=2))
    # Seconds are of all methods in one run, so that both are timed anew; one alone is scored.
    assert len(changed.rendered) == len(same.rendered) + CountedBench().count


def test_a_table_that_was_stopped_keeps_the_cells_it_has(tmp_path: Path) -> None:
    good = Counter()

    def stop() -> MadeMethod:
        raise KeyboardInterrupt

    stopping = RenderingMethod("stopping", "ours", (), stop)
    with pytest.raises(KeyboardInterrupt):
        measured(tmp_path, good.method(), stopping)
    good.rendered.clear()
    measured(tmp_path, good.method(), replace(stopping, make=Counter().method().make))
    assert len(good.rendered) == 1 + ROUNDS  # timed, and not scored again


def test_a_network_that_cannot_be_trained_is_a_row_with_its_reason(tmp_path: Path) -> None:
    def missing() -> MadeMethod:
        raise TorchMissing("the network has to be trained")

    found = measured(tmp_path, Counter().method(), RenderingMethod("missing", "1.0 here", (), missing))
    assert found["missing"].missing == "the network has to be trained"
    assert found["missing"].scores == {}
    assert len(found["counted"].seconds) > 0


def test_methods_render_in_turn(tmp_path: Path) -> None:
    order: list[str] = []

    def observe(name: str) -> MadeMethod:
        def render(number: int) -> AnyArray:
            order.append(name)
            return np.array(number)

        return MadeMethod(render)

    time_in_turn({"a": observe("a"), "b": observe("b")}, 2, rounds=3)
    assert order == ["a", "b"] * 4  # one round to warm up


def test_a_graph_is_trained_once_and_torch_is_asked_for_only_then(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = Store(tmp_path)
    data, seconds = load_or_train_graph(store, ("one", 1), "one", lambda: b"graph", torch=False)
    monkeypatch.setattr("experiments.paper.rendering.find_spec", lambda name: None)
    assert (
        load_or_train_graph(store, ("one", 1), "one", lambda: b"other")
        == (data, seconds)
        == (b"graph", seconds)
    )
    with pytest.raises(TorchMissing, match=r"pip install"):
        load_or_train_graph(store, ("two", 1), "two", lambda: b"other")
