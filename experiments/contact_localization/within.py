"""Answer a recording within a budget of seconds, or to an error: the levels come from the measured front."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import as_file, files
from pathlib import Path

import numpy as np

from experiments.contact_localization.answer import observe, prior_of
from experiments.contact_localization.dials import FINEST, METHOD, SPACING
from experiments.contact_localization.model_of import model_of_run
from experiments.contact_localization.solving import (
    ESTIMATOR,
    PROGRAM,
    Readings,
    Setting,
    Solved,
    object_key,
    prepare,
    read,
    solve,
)
from harness.accuracy import Level
from harness.cost import Curve, Point
from harness.cost_bounds import most_seconds
from harness.cost_choice import for_budget, for_error, nearest_condition, promised
from harness.cost_file import curve_path, load
from harness.cost_provenance import code, machine, stale
from harness.errors import WrongUse
from harness.recording import Recording
from harness.run_folder import RunFiles
from harness.scene import SceneFile

SHIPPED = "data/cost.json"


@dataclass(frozen=True)
class Target:
    """What is asked of an answer: one of the two.

    Attributes:
        seconds: s on the clock for the estimate.
        error: m.
    """

    seconds: float | None = None
    error: float | None = None

    def __post_init__(self) -> None:
        if (self.seconds is None) == (self.error is None):
            raise WrongUse("give either a budget of seconds or an error to be met")


@dataclass(frozen=True, eq=False)
class Front:
    """The measured settings that a run goes by.

    Attributes:
        points: of the condition nearest to the run's.
        scale: how many times their seconds are to be expected, for its number of contacts.
        contacts: how many the points were measured with.
        reasons: why the curve is stale; empty where it is not.
        made: when it was measured.
        shipped: whether it came with the program.
    """

    points: tuple[Point, ...]
    scale: float
    contacts: int
    reasons: tuple[str, ...]
    made: str
    shipped: bool

    @property
    def vouches(self) -> bool:
        """Whether errors may be promised: the points were measured with no more contacts than the run has."""
        return self.scale >= 1.0

    @property
    def trusted(self) -> bool:
        """Whether it was measured on this machine with this code."""
        return not self.reasons


@dataclass(frozen=True, eq=False)
class Within:
    """An answer as it was asked for.

    Attributes:
        setting: that gave it.
        name: of the setting.
        solved: the answer itself.
        seconds: s on the clock, from readings to answer.
        cpu: s of CPU time, likewise.
        predicted: s it was expected to take at most.
        promise: m within which the truth lies in 95 % of runs; infinity where nothing is promised.
        kept: whether the budget was kept, or the error promised.
        tried: names of the settings tried, in order.
        finest: the answer at the finest levels, made afterwards.
        finest_seconds: s on the clock that it took in all.
    """

    setting: Setting
    name: str
    solved: Solved
    seconds: float
    cpu: float
    predicted: float
    promise: float
    kept: bool
    tried: tuple[str, ...]
    finest: Solved
    finest_seconds: float


def front_for(scene: SceneFile, contacts: int) -> Front:
    """The curve of this machine, or the one that came with the program, for runs like this one.

    Raises:
        WrongUse: nothing like this run was measured.
        DataRefused: this machine's curve is damaged.
    """
    wanted: dict[str, Level] = {
        "spacing": scene.localization.spacing,
        "gap": "default",  # a real bench has one, and a mocked one without is only cheaper to please
        "yaw": scene.localization.yaw,
        "contacts": contacts,
    }
    path = curve_path(PROGRAM)
    own = load(path) if path.exists() else None
    now, here = code(ESTIMATOR), machine()
    if own is not None and _has(own, wanted):
        return _front(own, wanted, stale(own, here, now), shipped=False)
    shipped = shipped_curve()
    return _front(shipped, wanted, stale(shipped, here, now), shipped=True)


def shipped_curve() -> Curve:
    """The curve that comes with the program, of another machine or an earlier state of the code."""
    with as_file(files("experiments.contact_localization").joinpath(SHIPPED)) as path:
        return load(Path(path))


def _has(curve: Curve, wanted: Mapping[str, Level]) -> bool:
    return bool(curve.where({name: value for name, value in wanted.items() if name != "contacts"}))


def _front(curve: Curve, wanted: Mapping[str, Level], reasons: Sequence[str], shipped: bool) -> Front:
    condition, scale = nearest_condition(curve.conditions(), wanted, "contacts")
    return Front(
        curve.where(condition), scale, int(condition["contacts"]), tuple(reasons), curve.made, shipped
    )


def foresee(front: Front, target: Target, name: str) -> str:
    """What will be tried, in a sentence.

    Raises:
        WrongUse: the cheapest setting measured on this machine takes longer than the budget.
    """
    if target.seconds is None:
        assert target.error is not None
        tried = for_error(front.points, target.error, name)
        return f"for an error of {1e3 * target.error:g} mm: {', then '.join(point.name for point in tried)}"
    found = for_budget(front.points, target.seconds, name, front.scale)
    if not found.fits and front.trusted:
        raise WrongUse(
            f"a budget of {target.seconds:g} s cannot be kept: the cheapest setting may take "
            f"{found.seconds:.2g} s here ({found.point.name}); allow more, or touch less often"
        )
    return f"for {target.seconds:g} s: {found.point.name}, at most {found.seconds:.2g} s"


def answer_within(recording: Recording, front: Front, target: Target) -> Within:
    """Answer a recorded run as asked, then once more at the finest levels.

    The seconds are from readings in memory to the answer. What depends on the object alone, its
    samples, and the loading of compiled kernels come before and are not counted.
    """
    run = RunFiles(recording)
    model, prior = model_of_run(run), prior_of(run)
    seed = recording.header.seed
    observations = observe(run)
    if not observations:
        raise WrongUse(f"{recording.folder} holds no contact yet; go on with `touchstone run --resume`")
    name = object_key(run.scene.object.name, run.mesh)
    candidates = _candidates(front, target, name)
    for point in candidates:
        prepare(model, point.levels)
    first = read(observations[:1], model, prior, seed)
    for point in {point.levels[METHOD.name]: point for point in reversed(candidates)}.values():
        solve(first, point.levels)  # loads the compiled kernels of each method
    cpu, wall = time.process_time(), time.perf_counter()
    readings = read(observations, model, prior, seed)
    point, solved, predicted, tried, promise = _solved(readings, front, target, name, candidates)
    taken = time.process_time() - cpu, time.perf_counter() - wall
    kept = taken[1] <= target.seconds if target.seconds is not None else promise <= (target.error or 0.0)
    prepare(model, FINEST)
    finest = solve(readings, FINEST)
    return Within(
        setting=point.levels,
        name=point.name,
        solved=solved,
        seconds=taken[1],
        cpu=taken[0],
        predicted=predicted,
        promise=promise,
        kept=kept and solved.estimate is not None,
        tried=tried,
        finest=finest,
        finest_seconds=readings.shared[1] + finest.wall,
    )


def _candidates(front: Front, target: Target, name: str) -> tuple[Point, ...]:
    """What may be taken, and is prepared for.

    For an error its tries; for a budget what fits on a machine as fast as the curve's and, should
    this one prove slower now, cheaper settings on the same samples.
    """
    if target.error is not None:
        return for_error(front.points, target.error, name)
    assert target.seconds is not None
    chosen = for_budget(front.points, target.seconds, name, front.scale)
    cheaper = [
        point
        for point in front.points
        if point is chosen.point
        or (
            most_seconds(point, name, front.scale) < 0.7 * chosen.seconds
            and point.levels[SPACING.name] == chosen.point.levels[SPACING.name]
        )
    ]
    cheapest = min(front.points, key=lambda point: most_seconds(point, name, front.scale))
    return tuple(dict.fromkeys((*cheaper, cheapest)))


def _solved(
    readings: Readings, front: Front, target: Target, name: str, candidates: Sequence[Point]
) -> tuple[Point, Solved, float, tuple[str, ...], float]:
    if target.seconds is not None:
        speed = _speed(readings, front) * front.scale
        found = for_budget(candidates, target.seconds, name, speed, readings.shared[1])
        solved = solve(readings, found.point.levels)
        return found.point, solved, found.seconds, (found.point.name,), _promise(front, found.point, solved)
    tried: list[str] = []
    spent = readings.shared[1]
    for point in candidates:
        tried.append(point.name)
        spent = most_seconds(point, name, front.scale, spent)
        solved = solve(readings, point.levels)
        promise = _promise(front, point, solved)
        assert target.error is not None
        if promise <= target.error:
            break
    return point, solved, spent, tuple(tried), promise


def _speed(readings: Readings, front: Front) -> float:
    """Seconds on the clock that a measured CPU second takes now, as the images' reading shows.

    On the machine of the curve it never counts as less than 1: a single fast reading promises
    nothing about the rest.
    """
    measured = float(np.median([s.shared for point in front.points for s in point.samples]))
    now = readings.shared[1] / front.scale / measured
    return max(1.0, now) if front.trusted else now


def _promise(front: Front, point: Point, solved: Solved) -> float:
    if solved.estimate is None or not front.vouches:
        return float("inf")
    return promised(point, solved.estimate.credible90)
