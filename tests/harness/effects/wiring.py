"""Writes ``wired.py``, by which mypy checks the wiring of the effects: ``make reference``.

An effect takes each quantity by the name of a parameter, which mypy does not follow. The module that is
written calls every effect by keyword with the quantities and levels of its parameters.
"""

import inspect
import sys
from collections.abc import Iterable
from pathlib import Path

from harness.effects.catalogue import EFFECTS
from harness.effects.effect import Effect, parameter_name, quantity_name
from harness.effects.quantities import Quantities
from harness.effects.touch_press import PRESS_EFFECTS

WIRED = Path(__file__).with_name("wired.py")


def wiring(effects: Iterable[Effect], quantities: type = Quantities) -> str:
    """The text of a module that calls every function of a catalogue."""
    lines: dict[str, None] = {}  # those of two catalogues, once
    modules: set[str] = set()
    for effect in effects:
        target = f'computed["{parameter_name(effect.provides)}"]'
        for way in (effect, *effect.ways.values()):
            modules.add(way.compute.__module__)
            name = f"{way.compute.__module__}.{way.compute.__qualname__}"
            lines[f"{target} = {name}({', '.join(_arguments(way))})"] = None
        if effect.bypass is not None:
            lines[f'{target} = given["{parameter_name(effect.bypass)}"]'] = None
    kind = quantities.__name__
    return "\n".join([
        '"""Every effect, called with the quantities that it takes; written by ``make reference``."""',
        "",
        *(f"import {module}" for module in sorted(modules)),
        "from harness.effects.accuracy import Accuracy",
        f"from {quantities.__module__} import {kind}",
        "",
        "",
        f"def wired(given: {kind}, computed: {kind}, accuracy: Accuracy) -> None:",
        *(f"    {line}" for line in lines),
        "",
    ])  # fmt: skip


def _arguments(way: Effect) -> list[str]:
    """Quantities by their parameters, and levels by the knobs of the function's module."""
    found = []
    for each in inspect.signature(way.compute).parameters.values():
        value = f'given["{each.name}"]'
        if each.kind is inspect.Parameter.KEYWORD_ONLY:
            (knob,) = (knob for knob in way.knobs if knob.name == quantity_name(each.name))
            home = way.compute.__module__
            names = (name for name, constant in vars(sys.modules[home]).items() if constant is knob)
            value = f"accuracy.of({home}.{next(names)})"
        found.append(f"{each.name}={value}")
    return found


def current() -> str:
    """The text of ``wired.py``, but for its layout."""
    return wiring((*EFFECTS, *PRESS_EFFECTS))


if __name__ == "__main__":
    WIRED.write_text(current(), encoding="utf-8")
