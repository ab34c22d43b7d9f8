"""An effect: a typed function that computes one quantity, and when a scene calls for it.

The parameters of the function name its needs, as fixtures do in pytest. ``touch_gel`` is the quantity
``touch.gel``: a parameter has the first underscore where the quantity has its dot. A parameter with a default
is a source that a caller may leave out. A keyword-only parameter is the level of a knob, by the same rule.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from inspect import Parameter, formatannotation, signature
from typing import ForwardRef, Literal, get_args, get_origin

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
class Implementation:
    """A function that computes the quantity of an effect at one level of its ``choice``."""

    compute: Compute  #: pure; its parameters name its needs and its knobs.
    when: Condition | None = None  #: the scene has what it is computed from; None for always.
    knobs: tuple[Knob[Level], ...] = ()  #: that its keyword-only parameters are levels of.
    version: int = 1  #: raised with every change of what it computes, so that stored results are dropped.
    stored: bool = False  #: whether a result is worth keeping on disk.


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
    choice: Knob[Level] | None = None  #: between implementations; None where there is one.
    ways: Mapping[Level, Implementation] = field(default_factory=dict, hash=False)
    """by the levels of ``choice``; the effect's own is for the levels not named here."""

    @property
    def needs(self) -> tuple[str, ...]:
        """Quantities that it is always computed from, in the order of the parameters."""
        return needs_of(self.compute)

    def way(self, accuracy: Accuracy) -> Implementation | None:
        """Return the implementation that an accuracy chooses; None for the effect's own."""
        return None if self.choice is None else self.ways.get(accuracy[self.choice.name])

    def at(self, accuracy: Accuracy) -> "Effect":
        """Return the effect as an accuracy has it computed."""
        way = self.way(accuracy)
        if way is None:
            return self
        return replace(self, compute=way.compute, knobs=way.knobs, version=way.version, stored=way.stored)


_BY_NAME = (Parameter.POSITIONAL_OR_KEYWORD, Parameter.KEYWORD_ONLY)


@cache
def _parameters(compute: Compute) -> tuple[Parameter, ...]:
    return tuple(signature(compute).parameters.values())


def needs_of(compute: Compute, given: frozenset[str] = frozenset()) -> tuple[str, ...]:
    """Return the quantities that a function takes, in the order of its parameters.

    Args:
        compute: of an effect.
        given: sources; a parameter with a default counts only where it is one of them.
    """
    names = [
        (quantity_name(each.name), each.default is Parameter.empty)
        for each in _parameters(compute)
        if each.kind is Parameter.POSITIONAL_OR_KEYWORD
    ]
    return tuple(name for name, required in names if required or name in given)


def build_catalogue(*effects: Effect, quantities: type = Quantities) -> tuple[Effect, ...]:
    """Check effects against each other and return them.

    Args:
        effects: in the order in which ``explain`` lists them.
        quantities: a ``TypedDict`` with the types of sources and quantities by their parameter names; a
            quantity that it leaves out has the type that its effect returns.

    Raises:
        ValueError: two effects provide one quantity; a bypass that the effect does not need; an
            implementation of no level; or a function whose parameters do not fit its row, the quantities or
            the knobs.
    """
    types: dict[str, object] = {
        quantity_name(name): kind for name, kind in quantities.__annotations__.items()
    }
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
        types.setdefault(effect.provides, signature(effect.compute).return_annotation)
    for effect in effects:
        _require_types(effect.provides, effect.compute, effect.knobs, types)
        for way in effect.ways.values():
            _require_types(effect.provides, way.compute, way.knobs, types)
    return effects


def _require_types(
    provides: str, compute: Compute, knobs: tuple[Knob[Level], ...], types: Mapping[str, object]
) -> None:
    """Refuse a function whose annotations are not those of the quantities and knobs that it names."""
    home = f"the effect {provides} ({compute.__qualname__})"
    returned = signature(compute).return_annotation
    if not _same(returned, types[provides]):
        raise ValueError(f"{home} returns {_text(returned)}, and {provides} is {_text(types[provides])}")
    levels = {parameter_name(knob.name): knob.levels for knob in knobs}
    for name, kind in ((each.name, each.kind) for each in _parameters(compute)):
        if (kind is Parameter.KEYWORD_ONLY) != (name in levels) or kind not in _BY_NAME:
            raise ValueError(
                f"{home}: the parameter {name} is a {kind.description} one, and the knobs of the row are "
                f"{list(levels)}; quantities stand before the *, and levels of knobs after it"
            )
    for name in set(levels) - {each.name for each in _parameters(compute)}:
        raise ValueError(f"{home} takes no level {name}, and its row has that knob")
    for each in _parameters(compute):
        quantity = quantity_name(each.name)
        if each.name in levels:
            if not all(_takes(each.annotation, level) for level in levels[each.name]):
                raise ValueError(
                    f"{home}: the level {each.name} is {_text(each.annotation)}, and the knob {quantity} has "
                    f"the levels {levels[each.name]}"
                )
        elif quantity not in types:
            raise ValueError(f"{home} needs {quantity}, which is no source, and no effect provides it")
        elif not _same(each.annotation, types[quantity]):
            raise ValueError(
                f"{home}: the parameter {each.name} is {_text(each.annotation)}, and {quantity} is "
                f"{_text(types[quantity])}"
            )


def _takes(annotation: object, level: Level) -> bool:
    """Whether a parameter with this annotation takes a level."""
    if get_origin(annotation) is Literal:
        return level in get_args(annotation)
    return annotation is type(level) or (annotation is float and isinstance(level, int))


def _same(one: object, other: object) -> bool:
    """Whether two annotations are one; the name decides for a type that only its user imports."""
    if isinstance(one, str | ForwardRef) or isinstance(other, str | ForwardRef):
        return _text(one) == _text(other)
    return one == other


def _text(annotation: object) -> str:
    if isinstance(annotation, ForwardRef):
        return annotation.__forward_arg__
    if isinstance(annotation, str):
        return annotation
    if isinstance(annotation, type) and not get_args(annotation):
        return annotation.__name__
    return formatannotation(annotation)


def knobs_of(effects: Iterable[Effect]) -> tuple[Knob[Level], ...]:
    """Return every knob of the effects, once, in order."""
    found = {knob.name: knob for effect in effects for knob in _knobs(effect)}
    return tuple(found.values())


def _knobs(effect: Effect) -> tuple[Knob[Level], ...]:
    chosen = () if effect.choice is None else (effect.choice,)
    return (*chosen, *effect.knobs, *(knob for way in effect.ways.values() for knob in way.knobs))
