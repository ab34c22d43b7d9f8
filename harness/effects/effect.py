"""An effect: a typed function that computes one quantity, and when a scene calls for it.

The parameters of the function name its needs, as fixtures do in pytest. ``touch_gel`` is the quantity
``touch.gel``: a parameter has the first underscore where the quantity has its dot. A parameter with a default
is a source that a caller may leave out. A keyword-only parameter is the level of a knob, by the same rule.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from inspect import Parameter, signature
from typing import ForwardRef

from harness.bench.scene import SceneFile
from harness.bench.sensor import TactileSensor
from harness.effects.accuracy import Accuracy, Knob, Level
from harness.effects.quantities import Quantities

Compute = Callable[..., object]
"""Takes quantities and levels by keyword; every array has a leading batch axis."""


def parameter_name(quantity: str) -> str:
    """Return the parameter that stands for a quantity or a knob: ``touch_gel`` for ``touch.gel``."""
    return quantity.replace(".", "_", 1)


def quantity_name(parameter: str) -> str:
    """Return the quantity or the knob that a parameter stands for: ``touch.gel`` for ``touch_gel``."""
    return parameter.replace("_", ".", 1)


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
class Effect:
    """One quantity that can be computed from others."""

    provides: str  #: the quantity's name.
    compute: Compute  #: pure; its parameters name its needs and its knobs.
    when: Condition | None = None  #: the scene calls for it; None for always.
    bypass: str | None = None
    """the quantity that takes its place where the scene does not call for it; None if asking for it is then
    an error."""
    knobs: tuple[Knob[Level], ...] = ()  #: that its keyword-only parameters are levels of.
    version: int = 1  #: raised with every change of what it computes, so that stored results are dropped.
    stored: bool = False  #: whether a result is worth keeping on disk.
    choice: Knob[Level] | None = None  #: between this function and others; None where there is one.
    ways: Mapping[Level, "Effect"] = field(default_factory=dict, hash=False)
    """the same quantity by other functions, by the levels of ``choice``; each with a condition, knobs, a
    version and storing of its own. This function is for the levels not named here."""

    @property
    def needs(self) -> tuple[str, ...]:
        """Quantities that it is always computed from, in the order of the parameters."""
        return needs_of(self.compute)

    def way(self, accuracy: Accuracy) -> "Effect | None":
        """Return the row that an accuracy chooses in place of this one; None for this one."""
        return None if self.choice is None else self.ways.get(accuracy[self.choice.name])

    def at(self, accuracy: Accuracy) -> "Effect":
        """Return the effect as an accuracy has it computed."""
        way = self.way(accuracy)
        if way is None:
            return self
        return replace(way, when=self.when, bypass=self.bypass, choice=self.choice, ways=self.ways)


@cache
def _parameters(compute: Compute) -> Mapping[str, Parameter]:
    return signature(compute).parameters


def needs_of(compute: Compute, given: frozenset[str] = frozenset()) -> tuple[str, ...]:
    """Return the quantities that a function takes, in the order of its parameters.

    Args:
        compute: of an effect.
        given: sources; a parameter with a default counts only where it is one of them.
    """
    return tuple(
        quantity_name(name)
        for name, each in _parameters(compute).items()
        if each.kind is not Parameter.KEYWORD_ONLY
        and (each.default is Parameter.empty or quantity_name(name) in given)
    )


def build_catalogue(*effects: Effect, quantities: type = Quantities) -> tuple[Effect, ...]:
    """Check effects against each other and return them.

    Args:
        effects: in the order in which ``explain`` lists them.
        quantities: a ``TypedDict`` with the types of sources and quantities by the names of parameters; a
            quantity that it leaves out has the type that its effect returns.

    Raises:
        ValueError: two effects provide one quantity; a bypass that the effect does not need; a function for
            no level; or a function whose parameters do not fit its row, the quantities or the knobs.
    """
    types: dict[str, object] = dict(quantities.__annotations__)
    provided: set[str] = set()
    for effect in effects:
        if effect.provides in provided:
            raise ValueError(f"two effects provide {effect.provides}; a quantity has one home")
        if effect.bypass is not None and effect.bypass not in effect.needs:
            raise ValueError(f"{effect.provides} is bypassed by {effect.bypass}, which it does not need")
        levels = () if effect.choice is None else effect.choice.levels
        if any(level not in levels for level in effect.ways):
            raise ValueError(f"the ways of {effect.provides} are {list(effect.ways)}, its levels {levels}")
        provided.add(effect.provides)
        types.setdefault(parameter_name(effect.provides), signature(effect.compute).return_annotation)
    for effect in effects:
        for row in (effect, *effect.ways.values()):
            if row.provides != effect.provides:
                raise ValueError(f"{row.provides} is no way to compute {effect.provides}")
            _require_types(row, types)
    return effects


def _require_types(effect: Effect, types: Mapping[str, object]) -> None:
    """Refuse a function whose parameters and type are not those of its knobs and of the quantities."""
    home = f"the effect {effect.provides} ({effect.compute.__qualname__})"
    returned, provided = signature(effect.compute).return_annotation, types[parameter_name(effect.provides)]
    if not _is_same(returned, provided):
        raise ValueError(f"{home} returns {_text(returned)}, and {effect.provides} is {_text(provided)}")
    levels, knobs = [], [knob.name for knob in effect.knobs]
    for name, each in _parameters(effect.compute).items():
        if each.kind is Parameter.KEYWORD_ONLY:
            levels.append(quantity_name(name))
        elif name not in types:
            raise ValueError(f"{home} needs {quantity_name(name)}, which no effect provides and no source is")
        elif not _is_same(each.annotation, types[name]):
            raise ValueError(
                f"{home}: the parameter {name} is {_text(each.annotation)}, and {quantity_name(name)} is "
                f"{_text(types[name])}"
            )
    if sorted(levels) != sorted(knobs):
        raise ValueError(f"{home}: the levels after its * are {levels}, and the knobs of its row {knobs}")


def _is_same(one: object, other: object) -> bool:
    """Compare two annotations, by name where a class is imported for type checkers alone."""
    named = isinstance(one, str | ForwardRef) or isinstance(other, str | ForwardRef)
    return _text(one) == _text(other) if named else one == other


def _text(annotation: object) -> str:
    if isinstance(annotation, ForwardRef):
        return annotation.__forward_arg__
    return annotation.__name__ if isinstance(annotation, type) else str(annotation)


def knobs_of(effects: Iterable[Effect]) -> tuple[Knob[Level], ...]:
    """Return every knob of the effects, once, in order."""
    found: dict[str, Knob[Level]] = {}
    for effect in effects:
        chosen = () if effect.choice is None else (effect.choice,)
        for knob in (*chosen, *effect.knobs, *knobs_of(effect.ways.values())):
            found.setdefault(knob.name, knob)
    return tuple(found.values())
