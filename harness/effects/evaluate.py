"""Run a plan: each of its effects once, on one fixed set of sources."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, cast

import numpy as np

from harness.basics.arrays import ByteArray, FloatArray
from harness.basics.clock import now
from harness.basics.errors import WrongUse
from harness.basics.store import Storable, Store, digest
from harness.effects.effect import parameter_name
from harness.effects.plan import Plan, PlannedEffect
from harness.effects.quantities import Quantities
from harness.sim.gel.contact_force import ContactForce
from harness.sim.light.direct_image import DirectImage
from harness.sim.modal.modal import from_arrays
from harness.sim.modal.modes import Modes

if TYPE_CHECKING:
    from harness.objectfile.touch.touch import ObjectTouch
    from harness.objectfile.vision.render import Rendered


@dataclass(frozen=True, eq=False)
class TouchResult:
    """The touch of an evaluation; None for a quantity that was not computed. ``n`` counts the contacts."""

    height_map: FloatArray | None  #: ``(n, rows, columns)`` m, the object in the undeformed gel.
    gel: FloatArray | None  #: ``(n, rows, columns)`` m of indentation of the gel's surface.
    image: ByteArray | None  #: ``(n, rows, columns, 3)`` RGB.
    shadow_out_of_table: FloatArray | None  #: ``(n,)`` share of the rim whose depth is not in the table.
    force: ContactForce | None
    codes: "ObjectTouch | None"  #: that the gel's surface comes from.


@dataclass(frozen=True, eq=False)
class SoundResult:
    """The sound of an evaluation; None for a quantity that was not computed. ``k`` counts the strikes."""

    modes: Modes | None
    sound: FloatArray | None  #: ``(k, t)`` Pa in the open.
    pressure: FloatArray | None  #: ``(k, t)`` Pa as the microphone reports them.


@dataclass(frozen=True, eq=False)
class PictureResult:
    """The scene camera's part of an evaluation; None for a quantity that was not computed."""

    image: "DirectImage | Rendered | None"


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
        """The gel, its picture and its force."""
        values = self.values
        return TouchResult(
            values.get("touch_height_map"),
            values.get("touch_gel"),
            values.get("touch_image"),
            values.get("touch_shadow_out_of_table"),
            values.get("touch_force"),
            values.get("object_touch_codes"),
        )

    @property
    def sound(self) -> SoundResult:
        """The modes and their sound."""
        values = self.values
        modes = None if "object_modes" not in values else from_arrays(values["object_modes"])
        return SoundResult(modes, values.get("object_sound"), values.get("microphone_pressure"))

    @property
    def picture(self) -> PictureResult:
        """The scene camera's picture."""
        return PictureResult(self.values.get("camera_image"))


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
        """Return a quantity, read from the store or computed on first use."""
        name = self.plan.resolved(quantity)
        parameter = parameter_name(name)
        if parameter not in self.values:
            self.values[parameter] = frozen(self._provide(self._planned[name]))
        return self.values[parameter]

    def _provide(self, step: PlannedEffect) -> object:
        effect, name = step.effect, step.effect.provides
        store = self.store if effect.stored else None
        start = now()
        found: object = None if store is None else store.get(self._key(name))
        if found is not None:
            self.seconds[name] = now() - start
            self.from_store.append(name)
            return found
        given = {parameter_name(need): self.value(need) for need in step.needs}
        levels = {parameter_name(knob.name): step.levels[knob.name] for knob in effect.knobs}
        start = now()
        found = effect.compute(**given, **levels)
        self.seconds[name] = now() - start
        self.calls[name] = self.calls.get(name, 0) + 1
        if store is not None:
            store.put(self._key(name), cast(Storable, found))
        return found

    def _key(self, quantity: str) -> str:
        """Hash what a quantity depends on: the effect's version and levels, and the same of all before it."""
        name = self.plan.resolved(quantity)
        if name not in self._keys and name not in self._planned:
            self._keys[name] = digest(self.values[parameter_name(name)])
        elif name not in self._keys:
            step = self._planned[name]
            needs = tuple(self._key(need) for need in step.needs)
            # The levels that distinguish a result from others.
            choice, levels = step.effect.choice, dict(step.levels)
            if choice is not None and levels[choice.name] not in step.effect.ways:
                del levels[choice.name]
            about = (name, step.effect.version, needs, tuple(sorted(levels.items())))
            self._keys[name] = digest(about)
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
