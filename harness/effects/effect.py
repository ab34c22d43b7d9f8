"""An effect: a quantity of the simulation, what it needs, and when a scene calls for it."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from harness.bench.scene import SceneFile
from harness.bench.sensor import TactileSensor
from harness.effects.accuracy import Accuracy, Knob, Level

Compute = Callable[[Mapping[str, Any], Mapping[str, Level]], Any]
"""From the needed quantities by name, and the levels of the effect's knobs by name."""


@dataclass(frozen=True)
class Facts:
    """What decides which effects a scene calls for."""

    scene: SceneFile  #: on the table.
    sensor: TactileSensor  #: on the flange.


@dataclass(frozen=True)
class Condition:
    """When an effect is called for, in code and in words."""

    holds: Callable[[Facts], bool]  #: the test.
    because: str  #: what is the case where it holds.
    otherwise: str  #: what is the case where it does not.


@dataclass(frozen=True)
class Implementation:
    """How one level of an effect's ``choice`` computes the quantity, where it is not as the effect itself."""

    needs: tuple[str, ...]  #: quantities it is computed from, in place of the effect's.
    compute: Compute  #: in place of the effect's.
    when: Condition | None = None  #: the scene has what it is computed from; None for always.
    knobs: tuple[Knob[Level], ...] = ()  #: in place of the effect's.
    version: int = 1  #: as of an effect.
    stored: bool = False  #: as of an effect.


@dataclass(frozen=True)
class Effect:
    """One quantity that can be computed from others."""

    provides: str  #: the quantity's name.
    needs: tuple[str, ...]  #: quantities it is computed from: other effects' or sources.
    compute: Compute  #: pure; every array it takes and gives has a leading batch axis.
    when: Condition | None = None  #: the scene calls for it; None for always.
    bypass: str | None = None
    """the quantity that takes its place where the scene does not call for it; None if asking for it is then
    an error."""
    knobs: tuple[Knob[Level], ...] = ()  #: that its levels are chosen by.
    version: int = 1  #: raised with every change of what it computes, so that stored results are dropped.
    stored: bool = False  #: whether a result is worth keeping on disk.
    choice: Knob[Level] | None = None  #: of ways to compute it; None where there is one.
    ways: Mapping[Level, Implementation] = field(default_factory=dict, hash=False)
    """by the levels of ``choice``; the effect's own is for the levels not named here."""

    def way(self, accuracy: Accuracy) -> Implementation | None:
        """The way that an accuracy chooses; None for the effect's own."""
        return None if self.choice is None else self.ways.get(accuracy[self.choice.name])

    def at(self, accuracy: Accuracy) -> "Effect":
        """The effect as an accuracy has it computed."""
        way = self.way(accuracy)
        if way is None:
            return self
        return replace(
            self,
            needs=way.needs,
            compute=way.compute,
            knobs=way.knobs,
            version=way.version,
            stored=way.stored,
        )


def by_name(effects: Iterable[Effect]) -> dict[str, Effect]:
    """The effects by what they provide.

    Raises:
        ValueError: two provide the same, a bypass is nothing that the effect needs, or a way is of no
            level.
    """
    known: dict[str, Effect] = {}
    for effect in effects:
        if effect.provides in known:
            raise ValueError(f"two effects provide {effect.provides}; a quantity has one home")
        if effect.bypass is not None and effect.bypass not in effect.needs:
            raise ValueError(f"{effect.provides} is bypassed by {effect.bypass}, which it does not need")
        levels = () if effect.choice is None else effect.choice.levels
        if any(level not in levels for level in effect.ways):
            raise ValueError(f"the ways of {effect.provides} are {list(effect.ways)}, its levels {levels}")
        known[effect.provides] = effect
    return known


def knobs_of(effects: Iterable[Effect]) -> tuple[Knob[Level], ...]:
    """Every knob of the effects, once, in order."""
    found = {knob.name: knob for effect in effects for knob in _knobs(effect)}
    return tuple(found.values())


def _knobs(effect: Effect) -> tuple[Knob[Level], ...]:
    chosen = () if effect.choice is None else (effect.choice,)
    return (*chosen, *effect.knobs, *(knob for way in effect.ways.values() for knob in way.knobs))
