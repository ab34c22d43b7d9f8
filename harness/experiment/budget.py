"""Answer a run within a budget of seconds, or to an error: the levels come from the measured front."""

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.basics.files.json_file import JsonObject
from harness.cost.bounds import most_seconds
from harness.cost.choice import for_budget, for_error
from harness.cost.curve import Point
from harness.cost.promise import promise
from harness.experiment.answer import require_steps
from harness.experiment.experiment import AnyExperiment
from harness.experiment.front import Front
from harness.experiment.measuring import measurement_of
from harness.experiment.solving import AnySolved, Solver, Target
from harness.recording.run_folder import RunFiles

_NOTHING = 1e-9
"""s that are left of a budget which counting has spent: the cheapest setting answers, and too late."""


@dataclass(frozen=True, eq=False)
class BudgetedAnswer:
    """An answer as it was asked for."""

    point: Point  #: the setting that gave it.
    solved: AnySolved  #: the answer itself.
    seconds: float  #: s on the clock, from readings to answer.
    cpu: float  #: s of CPU time, likewise.
    predicted: float  #: s it was expected to take at most.
    promise: float  #: m within which the truth lies in 95 % of runs; infinity where nothing is promised.
    kept: bool  #: whether the budget was kept, or the error promised.
    tried: tuple[str, ...]  #: names of the settings tried, in order.


def answer_as_asked(experiment: AnyExperiment, files: RunFiles, front: Front, target: Target) -> JsonObject:
    """Answer a recorded run as asked, then once more at the finest levels.

    The seconds are from readings in memory to the answer. What depends on the object alone, its
    samples and modes, and the loading of compiled kernels come before and are not counted.

    Returns:
        What was asked, what it took at which ``levels``, and what the finest levels say, as JSON values.

    Raises:
        WrongUse: the recording holds no step yet.
    """
    require_steps(experiment, files.recording)
    measured = measurement_of(experiment)
    run = measured.solver(files)
    front = front.fitting(run.explain_refusal)
    asked = ask(run, front, target)
    run.prepare(measured.finest)
    _, shared = run.read(measured.finest)
    finest = run.solve(measured.finest)
    said, best = _describe(asked.solved), _describe(finest)
    ours, theirs = said["position_m"], best["position_m"]
    known = ours is not None and theirs is not None
    return {
        "asked": target.as_json(),
        "setting": asked.point.name,
        "levels": dict(asked.point.levels),
        "tried": list(asked.tried),
        "seconds": asked.seconds,
        "cpu_s": asked.cpu,
        "predicted_at_most_s": asked.predicted,
        "promised_error_m": asked.promise if np.isfinite(asked.promise) else None,
        "kept": asked.kept,
        **said,
        "finest": {
            "setting": measured.setting_name(measured.finest),
            "seconds": shared + finest.wall,
            "apart_m": float(np.linalg.norm(np.subtract(ours, theirs))) if known else None,
            **best,
        },
        "curve": {
            "made": front.made,
            "stale": list(front.reasons),
            "shipped": front.shipped,
            experiment.plural: front.steps,
        },
    }


def _describe(solved: AnySolved) -> JsonObject:
    error = None if solved.found is None else solved.error
    return {"position_m": solved.position, "error_m": error, "refused": solved.refusal}


def ask(run: Solver, front: Front, target: Target) -> BudgetedAnswer:
    """Answer a run as asked; what is prepared before is not counted.

    Args:
        run: the readings.
        front: settings to choose from.
        target: what is asked.
    """
    candidates = _candidates(run, front, target)
    for point in candidates:
        run.prepare(point.levels)
    cpu, wall = time.process_time(), time.perf_counter()
    if target.seconds is not None:
        point, solved, predicted = _in_time(run, front, target.seconds, candidates)
        tried: tuple[str, ...] = (point.name,)
    else:
        assert target.error is not None
        point, solved, predicted, tried = _to_error(run, front, target.error, candidates)
    taken = time.process_time() - cpu, time.perf_counter() - wall
    promised = _promise(run, front, point, solved)
    kept = taken[1] <= target.seconds if target.seconds is not None else promised <= (target.error or 0.0)
    kept = kept and solved.found is not None
    return BudgetedAnswer(point, solved, taken[1], taken[0], predicted, promised, kept, tried)


def _candidates(run: Solver, front: Front, target: Target) -> tuple[Point, ...]:
    """What may be taken, and is prepared for.

    For an error its tries; for a budget what fits on a machine as fast as the curve's and, should
    this one prove slower now, cheaper settings that need nothing else prepared.
    """
    name = run.object
    if target.error is not None:
        return for_error(front.points, target.error, name)
    assert target.seconds is not None
    # Counted here to know what to prepare, and once more on the clock.
    work = run.work(front.points[0].levels)
    chosen = for_budget(front.points, target.seconds, name, front.scale, work=work)
    cheaper = [
        point
        for point in front.points
        if point is chosen.point
        or (
            most_seconds(point, name, front.scale, work=work) < 0.7 * chosen.seconds
            and run.shares_preparation(point.levels, chosen.point.levels)
        )
    ]
    cheapest = min(front.points, key=lambda point: most_seconds(point, name, front.scale, work=work))
    return tuple(dict.fromkeys((*cheaper, cheapest)))


def _in_time(
    run: Solver, front: Front, seconds: float, candidates: Sequence[Point]
) -> tuple[Point, AnySolved, float]:
    start = time.perf_counter()
    work = run.work(candidates[0].levels)
    counting = time.perf_counter() - start
    left = max(seconds - counting, _NOTHING)
    found = for_budget(candidates, left, run.object, front.scale, work=work)
    _, spent = run.read(found.point.levels)
    if _shares(found.point):
        # Reading what every such setting needs has shown how fast this machine is now: seconds on the clock
        # that a measured CPU second takes. On the machine of the curve it never counts as less than 1: a
        # single fast reading promises nothing about the rest.
        shared = [s.shared for p in front.points if _shares(p) for s in p.samples]
        speed = spent / front.scale / float(np.median(shared))
        speed = max(1.0, speed) if front.trusted else speed
        found = for_budget(candidates, left, run.object, speed * front.scale, spent, work)
    return found.point, run.solve(found.point.levels), counting + found.seconds


def _to_error(
    run: Solver, front: Front, error: float, candidates: Sequence[Point]
) -> tuple[Point, AnySolved, float, tuple[str, ...]]:
    tried: list[str] = []
    whole, spent = False, 0.0
    for point in candidates:
        tried.append(point.name)
        if len(tried) == 1 or (_shares(point) and not whole):
            whole, spent = _shares(point), spent + run.read(point.levels)[1]
        spent = most_seconds(point, run.object, front.scale, spent)
        solved = run.solve(point.levels)
        if _promise(run, front, point, solved) <= error:
            break
    return point, solved, spent, tuple(tried)


def _shares(point: Point) -> bool:
    """Whether a setting was measured to need what settings share."""
    return any(sample.shared > 0.0 for sample in point.samples)


def _promise(run: Solver, front: Front, point: Point, solved: AnySolved) -> float:
    if solved.radius is None or not front.vouches:
        return float("inf")
    return promise(point, solved.radius, run.object)


def sentences(experiment: AnyExperiment, cost: JsonObject) -> tuple[str, ...]:
    """For people, what ``answer_as_asked`` gave."""
    finest, said = cost["finest"], []
    if finest["refused"] is not None:
        what = f"refused these readings: {finest['refused']}"
    else:
        if finest["apart_m"] is not None:
            said.append(f"lie {1e3 * finest['apart_m']:.1f} mm from this answer")
        if finest["error_m"] is not None:
            said.append(f"would have been off by {1e3 * finest['error_m']:.1f} mm")
        what = f"{' and '.join(said) or 'answer too'}; {finest['seconds']:.2g} s, not counted"
    return _took(experiment, cost), f"the finest levels ({finest['setting']}) {what}"


def _took(experiment: AnyExperiment, cost: JsonObject) -> str:
    budget, error = cost["asked"]["budget_s"], cost["asked"]["error_m"]
    took = f"{cost['seconds']:.2g} s ({cost['cpu_s']:.2g} s of CPU time) at {cost['setting']}"
    promise = cost["promised_error_m"]
    within = "no error is promised" if promise is None else f"within {1e3 * promise:.1f} mm in 19 of 20 runs"
    if budget is not None:
        kept = "kept" if cost["kept"] else "NOT kept"
        return f"budget {budget:g} s {kept}: the estimate took {took}; {within}"
    if cost["kept"]:
        return f"error {1e3 * error:g} mm promised: {within}; the estimate took {took}"
    return (
        f"error {1e3 * error:g} mm cannot be promised from these {experiment.plural}: {within}; the estimate "
        f"took {took}; one more {experiment.step} elsewhere on the object would tell most"
    )
