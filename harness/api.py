"""Touchstone from Python: what its commands do, as functions with typed results.

Lengths are metres, angles radians, frequencies hertz. Every result states its seconds and its error.
``import touchstone`` gives the same functions; ``examples/`` shows each in a script. A function is imported
when it is first used, so that importing this module takes no time.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from harness.tasks.audio import RenderedAudio, render_audio
    from harness.tasks.modes import modes
    from harness.tasks.runs import answer
    from harness.tasks.touch import tactile_image
    from harness.tasks.vision import ComparedVision, RenderedVision, compare_vision, render_vision

_HOMES = {
    "ComparedVision": "harness.tasks.vision",
    "RenderedAudio": "harness.tasks.audio",
    "RenderedVision": "harness.tasks.vision",
    "answer": "harness.tasks.runs",
    "compare_vision": "harness.tasks.vision",
    "modes": "harness.tasks.modes",
    "render_audio": "harness.tasks.audio",
    "render_vision": "harness.tasks.vision",
    "tactile_image": "harness.tasks.touch",
}
"""Name to the module that defines it."""

__all__ = [
    "ComparedVision",
    "RenderedAudio",
    "RenderedVision",
    "answer",
    "compare_vision",
    "modes",
    "render_audio",
    "render_vision",
    "tactile_image",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return __all__
