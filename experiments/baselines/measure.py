"""Quality and seconds of every method of a sense; what was measured is stored and not measured again."""

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from experiments.baselines.bench import MadeMethod, RenderingBench, RenderingMethod, RenderingWork
from experiments.baselines.stored_graph import TorchMissing
from harness.basics.arrays import FloatArray
from harness.basics.store import digest

VERSION = 1
"""Raised with every change of how cells are measured, so that stored ones are dropped."""

ROUNDS = 15
"""Of timing: in each, every method renders one query."""

_ENOUGH = 8.0
"""CPU s of one method's timing after which it takes no part in further rounds."""

_LEAST_ROUNDS = 2


@dataclass(frozen=True, eq=False)
class MeasuredMethod:
    """A method with its worth.

    Attributes:
        method: that was measured.
        scores: ``(n,)`` of each metric; empty where it could not be made.
        seconds: ``(k,)`` CPU s of one thread, of one observation each; empty likewise.
        made: CPU s of fitting or training.
        missing: why it could not be made; empty where it was.
    """

    method: RenderingMethod
    scores: Mapping[str, FloatArray]
    seconds: FloatArray
    made: float = 0.0
    missing: str = ""


class _Workshop:
    """Methods made when they are first used."""

    def __init__(self) -> None:
        self._made: dict[str, MadeMethod] = {}

    def made(self, method: RenderingMethod) -> MadeMethod:
        if method.name not in self._made:
            self._made[method.name] = method.make()
        return self._made[method.name]


def measure_sense(
    bench: RenderingBench, methods: Sequence[RenderingMethod], work: RenderingWork
) -> Iterator[MeasuredMethod]:
    """Every method of a sense, each cell stored as soon as it is measured.

    Quality is a cell a method. Seconds are one cell of all methods, which render in turn, so that what else
    the machine does meets them alike.

    Args:
        bench: of the sense.
        methods: with names that differ.
        work: where cells are stored.
    """
    workshop, worth = _Workshop(), {}
    missing: dict[str, str] = {}
    with threadpool_limits(limits=1):
        for number, method in enumerate(methods):
            work.report(f"{bench.sense}: {method.name}", number / len(methods))
            try:
                worth[method.name] = _quality(bench, method, workshop, work)
            except TorchMissing as reason:
                missing[method.name] = str(reason)
        work.report(f"{bench.sense}: seconds", 1.0)
        timed = _timing(bench, [each for each in methods if each.name in worth], workshop, work)
    for method in methods:
        if method.name in missing:
            yield MeasuredMethod(method, {}, np.empty(0), missing=missing[method.name])
        else:
            scores = dict(worth[method.name])
            made = float(scores.pop("made_s"))
            yield MeasuredMethod(method, scores, timed[method.name], made)


def _quality(
    bench: RenderingBench, method: RenderingMethod, workshop: _Workshop, work: RenderingWork
) -> Mapping[str, FloatArray]:
    """``(n,)`` of each metric, and ``made_s``."""
    key = digest(["rendering quality", VERSION, bench.identity, method.name, list(method.identity)])
    stored = work.store.get(key)
    if isinstance(stored, Mapping):
        return stored
    made = workshop.made(method)
    rows = [bench.scores(number, made.render(number)) for number in range(bench.count)]
    found = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    found["made_s"] = np.array(made.seconds)
    work.store.put(key, found)
    return found


def _timing(
    bench: RenderingBench, methods: Sequence[RenderingMethod], workshop: _Workshop, work: RenderingWork
) -> Mapping[str, FloatArray]:
    """``(k,)`` CPU s of each method, by its name."""
    every = [[method.name, list(method.identity)] for method in methods]
    key = digest(["rendering seconds", VERSION, bench.identity, every])
    stored = work.store.get(key)
    if isinstance(stored, Mapping):
        return {name.removeprefix("of "): seconds for name, seconds in stored.items()}
    made = {method.name: workshop.made(method) for method in methods}
    taken = timed_in_turn(made, bench.count)
    work.store.put(key, {f"of {name}": seconds for name, seconds in taken.items()})
    return taken


def timed_in_turn(made: Mapping[str, MadeMethod], count: int, rounds: int = ROUNDS) -> dict[str, FloatArray]:
    """``(k,)`` CPU s of each: in every round each renders one query, and a slow one in fewer rounds.

    Args:
        made: by name.
        count: of queries; rounds take them one after the other.
        rounds: at most.
    """
    taken: dict[str, list[float]] = {name: [] for name in made}
    for name, method in made.items():
        first = _seconds(method, 0)
        # What is slow has warmed up long before its first observation ends.
        taken[name] += [first] if first > 1.0 else []
    for number in range(rounds):
        for name, method in made.items():
            if len(taken[name]) < _LEAST_ROUNDS or sum(taken[name]) < _ENOUGH:
                taken[name].append(_seconds(method, number % count))
    return {name: np.array(seconds) for name, seconds in taken.items()}


def _seconds(made: MadeMethod, number: int) -> float:
    begun = time.process_time()
    made.render(number)
    return time.process_time() - begun
