"""Run a plan: each of its effects once, on one fixed set of sources."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from types import MappingProxyType
from typing import cast

import numpy as np

from harness.basics.clock import now
from harness.basics.errors import WrongUse
from harness.basics.store import Storable, Store, digest
from harness.effects.effect import Effect, parameter_name
from harness.effects.plan import Plan, PlannedEffect
from harness.effects.quantities import PictureResult, Quantities, SoundResult, TouchResult


@dataclass(frozen=True)
class Evaluation:
    """The quantities of a plan, and what they cost."""

    values: Quantities
    """by the names of parameters, and read-only: the sources, everything that was computed, and what passed
    through bypassed effects."""
    seconds: Mapping[str, float]  #: by effect, what each took; what came from the store took its reading.
    calls: Mapping[str, int]  #: by effect, how often it was computed.
    from_store: tuple[str, ...]  #: effects whose result was read instead of computed.

    def __getitem__(self, quantity: str) -> object:
        values: Mapping[str, object] = self.values
        return values[parameter_name(quantity)]

    @property
    def touch(self) -> TouchResult:
        """The gel and its picture."""
        return TouchResult.of(self.values)

    @property
    def sound(self) -> SoundResult:
        """The modes and their sound."""
        return SoundResult.of(self.values)

    @property
    def picture(self) -> PictureResult:
        """The scene camera's picture."""
        return PictureResult.of(self.values)


def evaluate(plan: Plan, sources: Quantities, store: Store | None = None) -> Evaluation:
    """Compute the quantities of a plan.

    With a store, a result in it is read, and what only this result needed is not computed.

    Args:
        plan: what to run.
        sources: a value for each of ``plan.sources``. A quantity of an effect among them takes the place of
            that effect.
        store: of results worth keeping; None to compute everything.

    Raises:
        WrongUse: a source is missing.
    """
    missing = [name for name in plan.sources if parameter_name(name) not in sources]
    if missing:
        needed = ", ".join(missing)
        raise WrongUse(f"{needed}: needed, computed by no effect, and not among the sources; give it")
    run = _Run(plan, store, dict(sources))
    for quantity in plan.wanted:
        run.value(quantity)
    for quantity in plan.aliases:
        passed = parameter_name(plan.resolved(quantity))
        if passed in run.values:
            run.values[parameter_name(quantity)] = run.values[passed]
    return Evaluation(
        cast(Quantities, MappingProxyType(run.values)),
        MappingProxyType(run.seconds),
        MappingProxyType(run.calls),
        tuple(run.from_store),
    )


@dataclass
class _Run:
    """The state of one evaluation."""

    plan: Plan
    store: Store | None
    values: dict[str, object]  #: by the names of parameters; the sources to begin with.
    seconds: dict[str, float] = field(default_factory=dict)
    calls: dict[str, int] = field(default_factory=dict)
    from_store: list[str] = field(default_factory=list)
    _keys: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        steps = {step.effect.provides: step for step in self.plan.ran}
        self._planned = {
            name: step for name, step in steps.items() if parameter_name(name) not in self.values
        }

    def value(self, quantity: str) -> object:
        """Return a quantity, computed on first use."""
        name = self.plan.resolved(quantity)
        parameter = parameter_name(name)
        if parameter not in self.values and not self._read(self._planned[name]):
            self._compute(self._planned[name])
        return self.values[parameter]

    def _compute(self, step: PlannedEffect) -> None:
        effect = step.effect
        given = {parameter_name(need): self.value(need) for need in step.needs}
        levels = {parameter_name(knob.name): step.levels[knob.name] for knob in effect.knobs}
        start = now()
        result = frozen(effect.compute(**given, **levels))
        self.seconds[effect.provides] = now() - start
        self.calls[effect.provides] = self.calls.get(effect.provides, 0) + 1
        self.values[parameter_name(effect.provides)] = result
        if self.store is not None and effect.stored:
            self.store.put(self._key(effect), cast(Storable, result))

    def _read(self, step: PlannedEffect) -> bool:
        """Whether the store had the result."""
        effect = step.effect
        if self.store is None or not effect.stored:
            return False
        start = now()
        found = self.store.get(self._key(effect))
        if found is None:
            return False
        self.values[parameter_name(effect.provides)] = frozen(found)
        self.seconds[effect.provides] = now() - start
        self.from_store.append(effect.provides)
        return True

    def _key(self, effect: Effect) -> str:
        """Hash what the result depends on: the effect's version and levels, and the same of all before it."""
        step = self._planned[effect.provides]
        if effect.provides not in self._keys:
            needs = [self._input_key(need) for need in step.needs]
            # The levels that tell a result from others.
            choice, levels = step.effect.choice, dict(step.levels)
            if choice is not None and levels[choice.name] not in step.effect.ways:
                del levels[choice.name]
            about = (effect.provides, effect.version, tuple(needs), tuple(sorted(levels.items())))
            self._keys[effect.provides] = digest(about)
        return self._keys[effect.provides]

    def _input_key(self, need: str) -> str:
        name = self.plan.resolved(need)
        if name in self._planned:
            return self._key(self._planned[name].effect)
        if name not in self._keys:
            self._keys[name] = digest(self.values[parameter_name(name)])
        return self._keys[name]


def frozen(value: object) -> object:
    """Return ``value`` with every array in it refusing to be written to; its own arrays, not copies."""
    if isinstance(value, np.ndarray):
        view = value.view()
        view.setflags(write=False)
        return view
    if isinstance(value, tuple):
        return tuple(frozen(item) for item in value)
    if isinstance(value, dict):
        return MappingProxyType({key: frozen(item) for key, item in value.items()})
    if is_dataclass(value) and not isinstance(value, type):
        for item in fields(value):
            part = vars(value).get(item.name)
            if isinstance(part, np.ndarray):
                part.setflags(write=False)
    return value
