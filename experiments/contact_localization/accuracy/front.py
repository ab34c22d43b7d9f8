"""The measured settings that a run goes by, and what is asked of its answer."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.resources import as_file, files
from pathlib import Path

from experiments.contact_localization.accuracy.dials import (
    needs_objectfile,
    needs_sound,
    saves_no_answer_time,
)
from experiments.contact_localization.accuracy.solving import ESTIMATOR, PROGRAM
from experiments.contact_localization.section import Localization
from harness.basics.errors import WrongUse
from harness.bench.scene import SceneFile
from harness.cost.choice import for_budget, for_error, nearest_condition
from harness.cost.curve import Curve, Point
from harness.cost.file import curve_path, load
from harness.cost.provenance import code, machine, stale
from harness.effects.accuracy import Level
from harness.experiment.experiment import Target

SHIPPED = "data/cost.json"


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

    def unheard(self) -> "Front":
        """Those settings that need no sound.

        Raises:
            WrongUse: there are none.
        """
        return self._without(
            needs_sound,
            "what accuracy costs was measured by sound alone, and this run was not heard; measure "
            "touch with `touchstone cost contact-localization --sense touch`",
        )

    def solved(self) -> "Front":
        """Those settings whose modes, if any, do not come from an ObjectFile.

        Raises:
            WrongUse: there are none.
        """
        return self._without(
            needs_objectfile,
            "what accuracy costs was measured with modes out of ObjectFiles alone, and this scene names "
            "none; name one, or measure without with `touchstone cost contact-localization`",
        )

    def _without(self, needs: Callable[[Mapping[str, Level]], bool], otherwise: str) -> "Front":
        points = tuple(point for point in self.points if not needs(point.levels))
        if not points:
            raise WrongUse(otherwise)
        return replace(self, points=points)


def front_for(scene: SceneFile, contacts: int) -> Front:
    """The curve of this machine, or the one that came with the program, for runs like this one.

    Raises:
        WrongUse: nothing like this run was measured.
        DataRefused: this machine's curve is damaged.
    """
    asked = scene.section(Localization)
    wanted: dict[str, Level] = {
        "spacing": asked.spacing,
        "gap": "default",  # a real bench has one, and a mocked one without is only cheaper to please
        "yaw": asked.yaw,
        "contacts": contacts,
    }
    path = curve_path(PROGRAM)
    own = load(path) if path.exists() else None
    now, here = code(ESTIMATOR), machine()
    if own is not None and _has(own, wanted):
        found = front_of(own, wanted, stale(own, here, now), shipped=False)
    else:
        shipped = shipped_curve()
        found = front_of(shipped, wanted, stale(shipped, here, now), shipped=True)
    found = found if scene.sensors.sound else found.unheard()
    return found if scene.object.objectfile is not None else found.solved()


def shipped_curve() -> Curve:
    """The curve that comes with the program, of another machine or an earlier state of the code."""
    with as_file(files("experiments.contact_localization").joinpath(SHIPPED)) as path:
        return load(Path(path))


def _has(curve: Curve, wanted: Mapping[str, Level]) -> bool:
    return bool(curve.where({name: value for name, value in wanted.items() if name != "contacts"}))


def front_of(curve: Curve, wanted: Mapping[str, Level], reasons: Sequence[str], shipped: bool) -> Front:
    """The settings of a curve for a condition, but for those that save no seconds of an answer.

    Coarser elements are measured for what they cost in accuracy; they are quicker once an object. Of settings
    that err alike one of them would be chosen by luck.

    Args:
        curve: measured.
        wanted: the run's condition.
        reasons: why the curve is stale; empty where it is not.
        shipped: whether it came with the program.

    Raises:
        WrongUse: nothing like the condition was measured.
    """
    condition, scale = nearest_condition(curve.conditions(), wanted, "contacts")
    measured = curve.where(condition)
    points = tuple(point for point in measured if not saves_no_answer_time(point.levels)) or measured
    return Front(points, scale, int(condition["contacts"]), tuple(reasons), curve.made, shipped)


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
