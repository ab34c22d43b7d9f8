"""What is asked of an answer beside its levels, and what an experiment gives to be answered so."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Generic, Protocol, TypeAlias, TypeVar

from harness.basics.errors import WrongUse
from harness.basics.files.json_file import JsonObject
from harness.bench.scene import SceneFile
from harness.cost.curve import Curve
from harness.effects.accuracy import Level, Setting
from harness.recording.run_folder import RunFiles

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


class Shared(Protocol):
    """Readings in memory, brought as far as settings share."""

    @property
    def shared(self) -> tuple[float, float]:
        """S of CPU time and on the clock that this took."""


ReadingsT = TypeVar("ReadingsT", bound=Shared)
Found = TypeVar("Found")
Found_co = TypeVar("Found_co", covariant=True)
Shared_co = TypeVar("Shared_co", bound=Shared, covariant=True)


@dataclass(frozen=True, eq=False)
class Solved(Generic[Found_co]):
    """An answer at one setting, and what it took beyond what settings share."""

    found: Found_co | None  #: the answer; None if it was refused.
    radius: float | None  #: m, within which the answer itself claims 90 %; None where it claims nothing.
    cpu: float  #: s of CPU time.
    wall: float  #: s on the clock.
    refusal: str | None = None  #: why, where it was refused.


class Solver(Protocol[ReadingsT, Found]):
    """A run's readings in memory, to be answered at any setting."""

    @property
    def object(self) -> str:
        """The name that its seconds were measured under."""

    def unfit(self, setting: Setting) -> str | None:
        """Why these readings cannot be answered at a setting; None where they can."""

    def prepare(self, setting: Setting) -> None:
        """Make what a setting needs of the object alone and load its kernels; no budget counts it."""

    def prepared_alike(self, one: Setting, other: Setting) -> bool:
        """Whether ``one`` needs nothing prepared that ``other`` does not."""

    def work(self, setting: Setting) -> float | None:
        """How much there is to do, see ``harness.cost.curve.Sample``; None where it is not counted."""

    def read(self, setting: Setting) -> ReadingsT:
        """Return the readings as a setting uses them."""

    def solve(self, readings: ReadingsT, setting: Setting) -> Solved[Found]:
        """Answer at one setting, timed, from what ``read`` gave for this or another one."""

    def described(self, solved: Solved[Found]) -> JsonObject:
        """As JSON values: ``position_m``, ``error_m`` and ``refused``, each None where there is none."""


@dataclass(frozen=True, eq=False)
class Budgets(Generic[Shared_co, Found_co]):
    """How an experiment answers as asked: within so many seconds, or to an error."""

    solver: Callable[[RunFiles], Solver[Shared_co, Found_co]]  #: of a run's readings.
    finest: Setting  #: the setting asked after an answer, to say what more time would have given.
    steps: Callable[[SceneFile], int]  #: that a run of a scene has.
    condition: Callable[[SceneFile], Mapping[str, Level]] = lambda _: {"gap": "default"}
    """of a scene's runs, as the points of a curve have it, but for the number of steps."""
    unfit: Callable[[SceneFile, Setting], str | None] = lambda _scene, _setting: None
    """why a scene's runs cannot be answered at a setting; None where they can."""
    offered: Callable[[Setting], bool] = lambda _: True
    """whether a setting is chosen while there are others."""
    shipped: Callable[[], Curve] | None = None  #: the curve that came with the program; None where none did.


AnyBudgets: TypeAlias = Budgets[Shared, object]
"""Budgets of any experiment; its readings go back to itself only."""
