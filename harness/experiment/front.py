"""The measured settings that a run goes by, and what may be asked of its answer."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from harness.basics.errors import DataRefused, WrongUse
from harness.bench.scene import SceneFile
from harness.cost.choice import for_budget, for_error, nearest_condition
from harness.cost.curve import Curve, Point
from harness.cost.file import curve_path, load
from harness.cost.promise import promise_share, smallest_promise, typical_promise
from harness.cost.provenance import code, machine, stale
from harness.effects.accuracy import Level, Setting
from harness.effects.scene_object import known_object
from harness.experiment.experiment import AnyExperiment
from harness.experiment.measuring import measurement_of
from harness.experiment.solving import Target
from harness.experiment.subjects import object_key
from harness.recording.run_folder import RunFiles


@dataclass(frozen=True, eq=False)
class Front:
    """The measured settings that a run goes by."""

    points: tuple[Point, ...]  #: of the condition nearest to the run's.
    scale: float  #: how many times their seconds are to be expected, for its number of steps.
    steps: int  #: how many the points were measured with.
    reasons: tuple[str, ...]  #: why the curve is stale; empty where it is not.
    made: str  #: when it was measured.
    shipped: bool  #: whether it came with the program.

    @property
    def vouches(self) -> bool:
        """Whether errors may be promised: the points were measured with no more steps than the run has."""
        return self.scale >= 1.0

    @property
    def trusted(self) -> bool:
        """Whether it was measured on this machine with this code."""
        return not self.reasons

    def at(self, levels: Mapping[str, Level]) -> Point | None:
        """Return the point that was measured at these levels; None if there is none."""
        return next((p for p in self.points if p.levels.items() <= levels.items()), None)

    def fitting(self, unfit: Callable[[Setting], str | None]) -> "Front":
        """Those settings that a run can be answered at.

        Args:
            unfit: why it cannot be at a setting; None where it can.

        Raises:
            WrongUse: there are none.
        """
        reasons = [unfit(point.levels) for point in self.points]
        points = tuple(point for point, why in zip(self.points, reasons, strict=True) if why is None)
        if not points:
            raise WrongUse(f"{reasons[0]}")
        return replace(self, points=points)


def front_for(experiment: AnyExperiment, scene: SceneFile, steps: int) -> Front:
    """Return the settings of this machine's curve, or of the one that came with the program, for a scene.

    Raises:
        WrongUse: nothing like this run was measured, or every setting in one run only.
        DataRefused: this machine's curve is damaged.
    """
    measured = measurement_of(experiment)
    like = measured.condition(scene)
    path = curve_path(experiment.name)
    measured_here = load(path) if path.exists() else None
    own = None if measured_here is None else _drop_single_runs(measured_here)
    shipped = None if own is not None and own.where(like) else measured.shipped_curve()
    curve = shipped or own
    if curve is not None and not curve.points:
        raise WrongUse(
            f"each setting of this machine's cost curve has one run, and a budget needs two or more; measure "
            f"more with `touchstone cost {experiment.name} --seeds 2`, or choose levels with --level"
        )
    if curve is None:
        raise WrongUse(
            f"what accuracy costs was not measured on this machine; measure it with `touchstone cost "
            f"{experiment.name}`, or choose levels with --level"
        )
    reasons = stale(curve, machine(), code(measured.estimator))
    front = front_of(experiment, curve, {**like, experiment.plural: steps}, reasons, shipped is not None)
    return front.fitting(lambda setting: measured.explain_refusal(scene, setting))


def _drop_single_runs(curve: Curve) -> Curve:
    """Drop the points with a single run: the spread of their seconds is unknown."""
    return replace(curve, points=tuple(point for point in curve.points if len(point.samples) > 1))


def front_at_hand(experiment: AnyExperiment, run: RunFiles) -> Front | None:
    """Return the measured settings of runs like this one; None if no curve of this machine has them."""
    try:
        return front_for(experiment, run.scene, run.recording.committed)
    except (WrongUse, DataRefused):
        return None


def front_of(
    experiment: AnyExperiment,
    curve: Curve,
    wanted: Mapping[str, Level],
    reasons: Sequence[str],
    shipped: bool,
) -> Front:
    """The settings of a curve for a condition, but for those that are not offered while there are others.

    Args:
        experiment: that the curve is of.
        curve: measured.
        wanted: the run's condition.
        reasons: why the curve is stale; empty where it is not.
        shipped: whether it came with the program.

    Raises:
        WrongUse: nothing like the condition was measured.
    """
    count, is_offered = experiment.plural, measurement_of(experiment).is_offered
    condition, scale = nearest_condition(curve.conditions(), wanted, count)
    measured = curve.where(condition)
    points = tuple(point for point in measured if is_offered(point.levels)) or measured
    return Front(points, scale, int(condition[count]), tuple(reasons), curve.made, shipped)


def foresee(experiment: AnyExperiment, scene: SceneFile, target: Target) -> str:
    """What will be tried, in a sentence, before anything moves.

    Args:
        experiment: to be run.
        scene: on the table.
        target: what is asked.

    Raises:
        WrongUse: the cheapest setting takes longer than the budget (by far, if the curve is stale); no
            setting promises the error, or none with so few steps; nothing like this run was measured, or
            the experiment keeps no budgets.
    """
    if experiment.count_steps is None:
        raise WrongUse(f"{experiment.name} has no --budget and no --error yet; choose levels with --level")
    front = front_for(experiment, scene, experiment.count_steps(scene))
    name = object_key(scene.object.name, known_object(scene).mesh)
    if target.seconds is None:
        assert target.error is not None
        tried = for_error(front.points, target.error, name)
        if promise_share(tried[-1], name, target.error) == 0.0:
            smallest = min(smallest_promise(point, name) for point in front.points)
            least = (
                f"the smallest error that is promised is {1e3 * smallest:.2g} mm"
                if np.isfinite(smallest)
                else "too few runs were measured to promise any"
            )
            raise WrongUse(
                f"an error of {1e3 * target.error:g} mm cannot be promised: no answer to runs like this one "
                f"did, at any setting; {least}, and half of the runs promise "
                f"{1e3 * typical_promise(tried[-1], name):.2g} mm ({tried[-1].name}); allow more, or take "
                f"more {experiment.plural}"
            )
        if not front.vouches:
            raise WrongUse(
                f"an error of {1e3 * target.error:g} mm cannot be promised: settings were measured with "
                f"{front.steps} {experiment.plural} and this run has fewer; take {front.steps} "
                f"{experiment.plural}, or measure fewer with `touchstone cost {experiment.name} --contacts N`"
            )
        return f"for an error of {1e3 * target.error:g} mm: {', then '.join(point.name for point in tried)}"
    found = for_budget(front.points, target.seconds, name, front.scale)
    if not found.fits and (front.trusted or _SPEED * target.seconds < found.seconds):
        where = "here" if front.trusted else f"where it was measured ({'; '.join(front.reasons)})"
        raise WrongUse(
            f"a budget of {target.seconds:g} s cannot be kept: the cheapest setting may take "
            f"{found.seconds:.2g} s {where} ({found.point.name}); allow more, or take fewer "
            f"{experiment.plural}"
        )
    return f"for {target.seconds:g} s: {found.point.name}, at most {found.seconds:.2g} s"


_SPEED = 10.0
"""A stale curve refuses a budget only if a machine this many times as fast could not keep it either."""


def doubts(experiment: AnyExperiment, front: Front, target: Target) -> tuple[str, ...]:
    """What the operator should know of the front before an answer goes by it."""
    said = [] if front.trusted else [staleness(experiment, front)]
    if target.error is not None and not front.vouches:
        said.append(
            f"settings were measured with {front.steps} {experiment.plural} and this run has fewer, so no "
            f"error is promised; measure fewer with `touchstone cost {experiment.name} --contacts N`"
        )
    return tuple(said)


def staleness(experiment: AnyExperiment, front: Front) -> str:
    """Why the front is not of this machine and code, what is done about it, and how to be rid of it."""
    kind = "the curve that came with the program" if front.shipped else "this machine's curve"
    return (
        f"{kind} is stale ({'; '.join(front.reasons)}): its seconds are scaled by what reading the "
        f"{experiment.plural} takes now; measure here with `touchstone cost {experiment.name}`"
    )
