"""How well to compute: dials with levels, and one choice of them all."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Generic, Literal, TypeVar, cast

from harness.basics.errors import WrongUse
from harness.basics.files.named_file import nearest

Level = str | int | float
"""One position of a dial: the name of a method, or a number."""

Setting = Mapping[str, Level]
"""Levels of some dials; what it leaves open is at its default."""

RETIRED_KNOBS: Mapping[str, str] = MappingProxyType({
    "scale.yaws": "leave it out: the fit of the outline starts from 12 turns",
    "scale.turns": "leave it out: touch of an unknown shape is averaged over 12 turns",
    "sound.radiation": "leave it out: every piece of the surface radiates as a monopole",
})  # fmt: skip
"""Knobs of earlier versions, and what to do instead of setting them."""

LevelT = TypeVar("LevelT", bound=Level, covariant=True)


@dataclass(frozen=True)
class Knob(Generic[LevelT]):
    """One dial."""

    name: str  #: of the effect it belongs to, or that and a word more: ``"touch.optics"``.
    levels: tuple[LevelT, ...]
    """from cheap to exact. Levels that are methods are only roughly ordered; what they cost and what they
    lose is measured."""
    unit: str  #: of a number, ``""`` for a method or a count.
    kind: Literal["number", "method"]  #: whether the levels are numbers or methods.
    default: LevelT  #: where nobody chooses.
    meaning: str = ""  #: what it dials, in a few words.
    removed: Mapping[Level, LevelT] = field(default_factory=dict, compare=False)
    """levels of earlier versions, each with the level that replaces it."""

    def __post_init__(self) -> None:
        if not self.levels or len(set(self.levels)) != len(self.levels):
            raise ValueError(f"the levels of {self.name} are {self.levels}; give one or more, each once")
        if any(isinstance(level, str) != (self.kind == "method") for level in self.levels):
            raise ValueError(f"{self.name} is a {self.kind} and has the levels {self.levels}")
        self.checked(self.default)

    def checked(self, level: Level) -> LevelT:
        """``level``, if the dial has it.

        Raises:
            WrongUse: it has not; those it has are listed.
        """
        for known in self.levels:
            if known == level and isinstance(known, str) == isinstance(level, str):
                return known
        if level in self.removed:
            raise WrongUse(f"{self.name} no longer has the level {level!r}; take {self.removed[level]}")
        hint = nearest(level, map(str, self.levels)) if isinstance(level, str) else f"it has {self._listed()}"
        raise WrongUse(f"{self.name} has no level {level!r}; {hint}")

    def read(self, text: str) -> LevelT:
        """The level that an operator wrote; ``WrongUse`` where there is none."""
        try:
            return self.checked(text.strip() if self.kind == "method" else float(text))
        except ValueError:
            raise WrongUse(f"{self.name} = {text!r} is not a number; it has {self._listed()}") from None

    def _listed(self) -> str:
        return ", ".join(map(str, self.levels)) + (f" ({self.unit})" if self.unit else "")


@dataclass(frozen=True)
class Accuracy(Mapping[str, Level]):
    """A level for each of some knobs; cannot be changed."""

    knobs: tuple[Knob[Level], ...]
    levels: Mapping[str, Level]

    def __post_init__(self) -> None:
        by_name = {knob.name: knob for knob in self.knobs}
        for name in self.levels:
            if name not in by_name:
                raise _unknown_knob(name, by_name)
        chosen = {name: by_name[name].checked(level) for name, level in self.levels.items()}
        whole = {knob.name: chosen.get(knob.name, knob.default) for knob in self.knobs}
        object.__setattr__(self, "levels", MappingProxyType(whole))

    @classmethod
    def default(cls, knobs: Iterable[Knob[Level]]) -> "Accuracy":
        """Every knob where nobody chooses."""
        return cls(tuple(knobs), {})

    def with_(self, changes: Mapping[str, Level]) -> "Accuracy":
        """The same choice but for ``changes``; ``WrongUse`` for an unknown knob or level."""
        return Accuracy(self.knobs, {**self.levels, **changes})

    def with_texts(self, texts: Sequence[str]) -> "Accuracy":
        """The same choice but for what an operator wrote: ``["touch.gel=fast"]``.

        Raises:
            WrongUse: not of that form, or an unknown knob or level.
        """
        by_name = {knob.name: knob for knob in self.knobs}
        changes: dict[str, Level] = {}
        for text in texts:
            name, equals, level = text.partition("=")
            if not equals:
                raise WrongUse(f"{text!r} does not set a knob; write KNOB=LEVEL, for example touch.gel=fast")
            if name.strip() not in by_name:
                raise _unknown_knob(name.strip(), by_name)
            changes[name.strip()] = by_name[name.strip()].read(level)
        return self.with_(changes)

    def of(self, knob: Knob[LevelT]) -> LevelT:
        """The level of one knob, as that has it."""
        return cast(LevelT, self[knob.name])

    def __getitem__(self, name: str) -> Level:
        if name not in self.levels:
            raise _unknown_knob(name, self.levels)
        return self.levels[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.levels)

    def __len__(self) -> int:
        return len(self.levels)


def current_levels(knobs: Iterable[Knob[Level]], stored: Mapping[str, Level]) -> dict[str, Level]:
    """Translate levels that an earlier version stored: leave out retired knobs, replace removed levels.

    Raises:
        WrongUse: a knob or a level that no version had.
    """
    by_name, found = {knob.name: knob for knob in knobs}, {}
    for name, level in stored.items():
        if name not in RETIRED_KNOBS:
            if name not in by_name:
                raise _unknown_knob(name, by_name)
            knob = by_name[name]
            found[name] = knob.checked(knob.removed.get(level, level))
    return found


def _unknown_knob(name: str, names: Iterable[str]) -> WrongUse:
    if name in RETIRED_KNOBS:
        return WrongUse(f"there is no knob {name} any more; {RETIRED_KNOBS[name]}")
    return WrongUse(f"no knob {name!r}; {nearest(name, names)}")
