"""Which effects will run for what is wanted, and which not, each with its reason."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

from harness.basics.errors import WrongUse
from harness.basics.files.named_file import nearest
from harness.effects.accuracy import Accuracy, Level
from harness.effects.effect import Effect, Facts, knobs_of, needs_of


@dataclass(frozen=True)
class PlannedEffect:
    """An effect that will run."""

    effect: Effect  #: itself, as its levels have it computed.
    needs: tuple[str, ...]  #: quantities that its function is called with.
    reason: str  #: who needs it, what in the scene calls for it, and in which of several ways it runs.
    levels: Mapping[str, Level]  #: of its knobs, the first that of its choice where it has one.


@dataclass(frozen=True)
class SkippedEffect:
    """An effect that will not run, and why."""

    effect: Effect
    reason: str


@dataclass(frozen=True)
class Plan:
    """What an evaluation will do."""

    wanted: tuple[str, ...]  #: quantities asked for.
    ran: tuple[PlannedEffect, ...]  #: effects in the order in which they run.
    skipped: tuple[SkippedEffect, ...]  #: every other effect of the catalogue but those that are supplied.
    aliases: Mapping[str, str]  #: quantities whose effect is bypassed, and what takes their place.
    sources: tuple[str, ...]  #: quantities that must be given.

    @property
    def levels(self) -> dict[str, Level]:
        """The level of every knob of an effect that runs."""
        return {name: level for step in self.ran for name, level in step.levels.items()}

    def resolved(self, quantity: str) -> str:
        """The quantity that stands for ``quantity`` once bypassed effects are passed through."""
        return _resolved(self.aliases, quantity)


@dataclass
class _Search:
    """A walk from what is wanted to the sources."""

    effects: Mapping[str, Effect]
    facts: Facts
    accuracy: Accuracy
    supplied: frozenset[str]
    order: list[str] = field(default_factory=list)
    asked_by: dict[str, list[str]] = field(default_factory=dict)
    aliases: dict[str, str] = field(default_factory=dict)
    sources: list[str] = field(default_factory=list)

    def visit(self, quantity: str, asked_by: str, path: tuple[str, ...]) -> None:
        """Note ``quantity`` and, before it, everything it needs."""
        if quantity in path:
            loop = " needs ".join((*path[path.index(quantity) :], quantity))
            raise ValueError(f"the effects go round in a circle: {loop}")
        seen = quantity in self.asked_by
        self.asked_by.setdefault(quantity, []).append(asked_by)
        if seen:
            return
        effect = self.effects.get(quantity)
        if effect is None or quantity in self.supplied:
            self.sources.append(quantity)
            return
        path = (*path, quantity)
        if effect.when is None or effect.when.holds(self.facts):
            self._require_way(effect)
            for need in needs_of(effect.compute, self.supplied):
                self.visit(need, quantity, path)
            self.order.append(quantity)
        elif effect.bypass is not None:
            self.aliases[quantity] = effect.bypass
            self.visit(effect.bypass, asked_by, path)
        else:
            who = f"{asked_by} needs {quantity}" if asked_by else f"{quantity} is asked for"
            raise WrongUse(f"{who}, but {effect.when.otherwise}; change the scene, or do not ask for it")

    def _require_way(self, effect: Effect) -> None:
        way, choice = effect.way(self.accuracy), effect.choice
        if choice is None or way is None or way.when is None or way.when.holds(self.facts):
            return
        raise WrongUse(
            f"{choice.name} = {self.accuracy[choice.name]}: {way.when.otherwise}; change the scene, or take "
            f"{choice.name} = {choice.default}"
        )


def plan(
    effects: Sequence[Effect],
    facts: Facts,
    wanted: Iterable[str],
    accuracy: Accuracy,
    supplied: Iterable[str] = (),
) -> Plan:
    """Plan what runs to compute ``wanted``, without computing anything.

    Args:
        effects: the catalogue.
        facts: of the scene and the sensor.
        wanted: quantities of the catalogue.
        accuracy: a level for every knob of the catalogue.
        supplied: quantities that the caller gives: one that an effect provides takes the place of that
            effect, and one that an effect can do without is used.

    Raises:
        WrongUse: a wanted quantity that no effect provides, or that the scene rules out; a level that
            the scene does not have what it takes for.
        ValueError: the effects need each other in a circle.
    """
    known = {effect.provides: effect.at(accuracy) for effect in effects}
    search = _Search(known, facts, accuracy, frozenset(supplied))
    wanted = tuple(wanted)
    for quantity in wanted:
        if quantity not in known:
            raise WrongUse(f"nothing computes {quantity!r}; {nearest(quantity, known)}")
        search.visit(quantity, "", ())
    ran = tuple(_planned(known[name], search) for name in search.order)
    skipped = tuple(
        SkippedEffect(effect, _why_not(effect, search))
        for effect in effects
        if effect.provides not in search.order and effect.provides not in search.supplied
    )
    return Plan(wanted, ran, skipped, MappingProxyType(search.aliases), tuple(search.sources))


def default_accuracy(effects: Iterable[Effect]) -> Accuracy:
    """Every knob of a catalogue where nobody chooses."""
    return Accuracy.default(knobs_of(effects))


def _planned(effect: Effect, search: _Search) -> PlannedEffect:
    asked_by, accuracy = search.asked_by[effect.provides], search.accuracy
    who = [f"{name} needs it" for name in asked_by if name]
    reasons = (["it is asked for"] if "" in asked_by else []) + who
    if effect.when is not None:
        reasons.append(effect.when.because)
    knobs, choice = effect.knobs, effect.choice
    if choice is not None:
        knobs = (choice, *knobs)
        way, level = effect.way(accuracy), accuracy[choice.name]
        why = f"{choice.name} is {level}"
        if way is not None and way.when is not None:
            why += f", and {way.when.because}"
        elif level == choice.default:
            why += ", its default"
        reasons.append(why)
    levels = MappingProxyType({knob.name: accuracy[knob.name] for knob in knobs})
    return PlannedEffect(effect, needs_of(effect.compute, search.supplied), "; ".join(reasons), levels)


def _why_not(effect: Effect, search: _Search) -> str:
    if effect.when is not None and not effect.when.holds(search.facts):
        in_its_place = _resolved(search.aliases, effect.provides)
        through = f"; {in_its_place} passes through" if effect.provides in search.aliases else ""
        return effect.when.otherwise + through
    return f"nothing asked for {effect.provides}"


def _resolved(aliases: Mapping[str, str], quantity: str) -> str:
    while quantity in aliases:
        quantity = aliases[quantity]
    return quantity
