"""Targets of an answer, and the solver of a run that meets them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Generic, Protocol, TypeAlias, TypeVar

from harness.basics.errors import WrongUse
from harness.basics.files.json_file import JsonObject
from harness.effects.accuracy import Setting

TARGET = "target"
"""The key of a run's plan that holds the target of its answer, for ``--resume``."""


@dataclass(frozen=True)
class Target:
    """What is asked of an answer: one of the two."""

    seconds: float | None = None  #: s on the clock for the estimate.
    error: float | None = None  #: m.

    def __post_init__(self) -> None:
        if (self.seconds is None) == (self.error is None):
            raise WrongUse("give either a budget of seconds or an error to be met")

    def as_json(self) -> dict[str, float | None]:
        """For a run's plan and its result."""
        return {"budget_s": self.seconds, "error_m": self.error}


def target_of(plan: JsonObject) -> Target | None:
    """The target that a run was planned with; None where it has none."""
    stored = plan.get(TARGET)
    return None if stored is None else Target(stored["budget_s"], stored["error_m"])


Found_co = TypeVar("Found_co", covariant=True)


@dataclass(frozen=True, eq=False)
class Solved(Generic[Found_co]):
    """An answer at one setting, and its seconds without those that settings share."""

    found: Found_co | None  #: the answer; None if it was refused.
    radius: float | None  #: m, 90 % radius of the answer; None if it has none.
    cpu: float  #: s of CPU time.
    wall: float  #: s on the clock.
    refusal: str | None = None  #: reason of a refusal.
    position: Sequence[float] | None = None  #: m, ``(3,)``; None if the answer is no position.
    error: float | None = None
    """error in m; None without a truth. A refused answer may have the error of an answer without readings."""


AnySolved: TypeAlias = Solved[object]
"""An answer of any experiment."""


class Solver(Protocol):
    """A run's readings in memory, to be answered at any setting."""

    @property
    def object(self) -> str:
        """Name of the object that its seconds were measured under."""

    def first(self, steps: int) -> "Solver":
        """Return the readings of the first steps alone."""

    def explain_refusal(self, setting: Setting) -> str | None:
        """State why these readings cannot be answered at a setting; None if they can."""

    def prepare(self, setting: Setting) -> None:
        """Compute a setting's models of the object and load its kernels; budgets do not count this time."""

    def shares_preparation(self, one: Setting, other: Setting) -> bool:
        """State whether the preparation of ``other`` includes that of ``one``."""

    def work(self, setting: Setting) -> float:
        """Return the amount of work, see ``harness.cost.curve.Sample``."""

    def read(self, setting: Setting) -> tuple[float, float]:
        """Compute the shared readings that a setting uses; return their CPU and wall time in s."""

    def solve(self, setting: Setting) -> AnySolved:
        """Compute the answer at one setting; its time starts after ``read``."""
