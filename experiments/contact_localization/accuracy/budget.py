"""Answer a run within a budget of seconds, or to an error: the levels come from the measured front."""

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from experiments.contact_localization.accuracy.dials import FINEST, SIMULATED, needs_images, needs_sound
from experiments.contact_localization.accuracy.front import Front
from experiments.contact_localization.accuracy.solving import (
    Models,
    Readings,
    Solved,
    object_key,
    prepare,
    read,
    solve,
)
from experiments.contact_localization.answer import observe, prior_of
from experiments.contact_localization.build_model import model_of_run
from experiments.contact_localization.model import Prior
from experiments.contact_localization.observation import Observation
from experiments.contact_localization.posterior.dials import METHOD, SENSES, SPACING
from experiments.contact_localization.posterior.problem_size import places_left
from harness.basics.errors import WrongUse
from harness.cost.bounds import most_seconds
from harness.cost.choice import for_budget, for_error
from harness.cost.curve import Point
from harness.cost.promise import promise
from harness.experiment.experiment import Setting, Target
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles

_NOTHING = 1e-9
"""s that are left of a budget which counting has spent: the cheapest setting answers, and too late."""


@dataclass(frozen=True, eq=False)
class Run:
    """What an answer is made from.

    Attributes:
        observations: of the contacts.
        models: of the object.
        prior: of its orientation.
        seed: of the draws.
        object: the name that its seconds were measured under.
    """

    observations: tuple[Observation, ...]
    models: Models
    prior: Prior
    seed: int
    object: str

    @property
    def heard(self) -> bool:
        """Whether any contact was struck."""
        return any(observation.strike is not None for observation in self.observations)

    def read(self, setting: Setting) -> Readings:
        """Its readings as a setting takes them."""
        return read(self.observations, self.models.at(setting), self.prior, self.seed, needs_images(setting))

    def places_left(self, setting: Setting) -> float:
        """How much there is to do, whatever the setting: on the object as a setting models it."""
        return places_left(self.observations, self.models.at(setting), self.prior)


@dataclass(frozen=True, eq=False)
class BudgetedAnswer:
    """An answer as it was asked for.

    Attributes:
        point: the setting that gave it.
        solved: the answer itself.
        seconds: s on the clock, from readings to answer.
        cpu: s of CPU time, likewise.
        predicted: s it was expected to take at most.
        promise: m within which the truth lies in 95 % of runs; infinity where nothing is promised.
        kept: whether the budget was kept, or the error promised.
        tried: names of the settings tried, in order.
    """

    point: Point
    solved: Solved
    seconds: float
    cpu: float
    predicted: float
    promise: float
    kept: bool
    tried: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class BudgetResult:
    """An answer as it was asked for, and what more time would have given.

    Attributes:
        asked: the answer.
        finest: the answer at the finest levels, made afterwards.
        finest_seconds: s on the clock that it took in all.
    """

    asked: BudgetedAnswer
    finest: Solved
    finest_seconds: float


def answer_within(recording: Recording, front: Front, target: Target) -> BudgetResult:
    """Answer a recorded run as asked, then once more at the finest levels.

    The seconds are from readings in memory to the answer. What depends on the object alone, its
    samples and modes, and the loading of compiled kernels come before and are not counted.

    Raises:
        WrongUse: the recording holds no contact yet.
    """
    files = RunFiles(recording)
    observations = observe(files)
    if not observations:
        raise WrongUse(f"{recording.folder} holds no contact yet; go on with `touchstone run --resume`")
    name = object_key(files.scene.object.name, files.mesh)
    models = Models(lambda accuracy: model_of_run(files, accuracy))
    run = Run(observations, models, prior_of(files), recording.header.seed, name)
    asked = ask(run, front if run.heard else front.unheard(), target)
    prepare(models.at(FINEST), FINEST)
    readings = run.read(FINEST)
    finest = solve(readings, FINEST)
    return BudgetResult(asked, finest, readings.shared[1] + finest.wall)


def ask(run: Run, front: Front, target: Target, loaded: bool = False) -> BudgetedAnswer:
    """Answer a run as asked; what is prepared and loaded before is not counted.

    Args:
        run: the readings.
        front: settings to choose from.
        target: what is asked.
        loaded: whether this process has answered by every sense and method before.
    """
    candidates = _candidates(run, front, target)
    for point in candidates:
        prepare(run.models.at(point.levels), point.levels)
    if not loaded:
        _load_kernels(run, candidates)
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
    kept = kept and solved.estimate is not None
    return BudgetedAnswer(point, solved, taken[1], taken[0], predicted, promised, kept, tried)


def _candidates(run: Run, front: Front, target: Target) -> tuple[Point, ...]:
    """What may be taken, and is prepared for.

    For an error its tries; for a budget what fits on a machine as fast as the curve's and, should
    this one prove slower now, cheaper settings on the same samples and modes.
    """
    name = run.object
    if target.error is not None:
        return for_error(front.points, target.error, name)
    assert target.seconds is not None
    # Counted here to know what to prepare, and once more on the clock.
    work = run.places_left(front.points[0].levels)
    chosen = for_budget(front.points, target.seconds, name, front.scale, work=work)
    cheaper = [
        point
        for point in front.points
        if point is chosen.point
        or (
            most_seconds(point, name, front.scale, work=work) < 0.7 * chosen.seconds
            and _prepared_alike(point.levels, chosen.point.levels)
        )
    ]
    cheapest = min(front.points, key=lambda point: most_seconds(point, name, front.scale, work=work))
    return tuple(dict.fromkeys((*cheaper, cheapest)))


def _prepared_alike(one: Setting, other: Setting) -> bool:
    modes = not needs_sound(one) or all(one.get(k.name) == other.get(k.name) for k in SIMULATED)
    return modes and one[SPACING.name] == other[SPACING.name]


def _load_kernels(run: Run, candidates: Sequence[Point]) -> None:
    """Answer two contacts by each sense and method."""
    struck = [observation for observation in run.observations if observation.strike is not None]
    few = (struck or list(run.observations))[:2]  # one strike says nothing, and is not weighed
    dearest_last = sorted(candidates, key=lambda point: point.seconds.value)
    kinds = {(p.levels.get(SENSES.name), p.levels[METHOD.name]): p.levels for p in dearest_last}
    for levels in kinds.values():
        solve(read(few, run.models.at(levels), run.prior, run.seed, needs_images(levels)), levels)


def _in_time(
    run: Run, front: Front, seconds: float, candidates: Sequence[Point]
) -> tuple[Point, Solved, float]:
    start = time.perf_counter()
    work = run.places_left(candidates[0].levels)
    counting = time.perf_counter() - start
    left = max(seconds - counting, _NOTHING)
    found = for_budget(candidates, left, run.object, front.scale, work=work)
    readings = run.read(found.point.levels)
    if needs_images(found.point.levels):
        # Reading the images, which every such setting needs, has shown how fast this machine is now.
        speed = _speed(readings, front) * front.scale
        found = for_budget(candidates, left, run.object, speed, readings.shared[1], work)
    levels = found.point.levels
    return found.point, solve(readings.under(run.models.at(levels)), levels), counting + found.seconds


def _to_error(
    run: Run, front: Front, error: float, candidates: Sequence[Point]
) -> tuple[Point, Solved, float, tuple[str, ...]]:
    tried: list[str] = []
    readings: Readings | None = None
    spent: float | None = None
    for point in candidates:
        tried.append(point.name)
        if readings is None or (needs_images(point.levels) and not readings.heights):
            readings = run.read(point.levels)
            spent = (spent or 0.0) + readings.shared[1]
        spent = most_seconds(point, run.object, front.scale, spent)
        solved = solve(readings.under(run.models.at(point.levels)), point.levels)
        if _promise(run, front, point, solved) <= error:
            break
    assert spent is not None
    return point, solved, spent, tuple(tried)


def _speed(readings: Readings, front: Front) -> float:
    """Seconds on the clock that a measured CPU second takes now, as the images' reading shows.

    On the machine of the curve it never counts as less than 1: a single fast reading promises
    nothing about the rest.
    """
    shared = [s.shared for p in front.points for s in p.samples if needs_images(p.levels)]
    now = readings.shared[1] / front.scale / float(np.median(shared))
    return max(1.0, now) if front.trusted else now


def _promise(run: Run, front: Front, point: Point, solved: Solved) -> float:
    if solved.estimate is None or not front.vouches:
        return float("inf")
    return promise(point, solved.estimate.credible90, run.object)
