"""Touchstone from Python: what its commands do, as functions with typed results.

Lengths are metres, angles radians, frequencies hertz. Every result states its seconds and its error.
``import touchstone`` gives the same functions; ``examples/`` shows each in a script. A function is imported
when it is first used, so that importing this module takes no time.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from harness.tasks.audio import RenderedAudio, render_audio
    from harness.tasks.bench import StationCheck, TakenPicture, check_station, open_station, take_picture
    from harness.tasks.depth import PressDepth, depth
    from harness.tasks.modes import modes
    from harness.tasks.objects import (
        AudioBuild,
        TouchBuild,
        VerifiedObject,
        VisionBuild,
        build_objectfile,
        load_object,
        verify_object,
    )
    from harness.tasks.runs import answer
    from harness.tasks.touch import tactile_image
    from harness.tasks.vision import ComparedVision, RenderedVision, compare_vision, render_vision

_HOMES = {
    "AudioBuild": "harness.tasks.objects",
    "ComparedVision": "harness.tasks.vision",
    "PressDepth": "harness.tasks.depth",
    "RenderedAudio": "harness.tasks.audio",
    "RenderedVision": "harness.tasks.vision",
    "StationCheck": "harness.tasks.bench",
    "TakenPicture": "harness.tasks.bench",
    "TaximResult": "calibration.taxim.result",
    "TouchBuild": "harness.tasks.objects",
    "VerifiedObject": "harness.tasks.objects",
    "VisionBuild": "harness.tasks.objects",
    "answer": "harness.tasks.runs",
    "build_objectfile": "harness.tasks.objects",
    "calibrate_taxim": "calibration.taxim.result",
    "check_station": "harness.tasks.bench",
    "compare_vision": "harness.tasks.vision",
    "depth": "harness.tasks.depth",
    "load_object": "harness.tasks.objects",
    "modes": "harness.tasks.modes",
    "open_station": "harness.tasks.bench",
    "render_audio": "harness.tasks.audio",
    "render_vision": "harness.tasks.vision",
    "tactile_image": "harness.tasks.touch",
    "take_picture": "harness.tasks.bench",
    "verify_object": "harness.tasks.objects",
}
"""Name to the module that defines it."""

__all__ = [
    "AudioBuild",
    "ComparedVision",
    "PressDepth",
    "RenderedAudio",
    "RenderedVision",
    "StationCheck",
    "TakenPicture",
    "TaximResult",  # noqa: F822 - above the core, so that no import names it
    "TouchBuild",
    "VerifiedObject",
    "VisionBuild",
    "answer",
    "build_objectfile",
    "calibrate_taxim",  # noqa: F822 - above the core, so that no import names it
    "check_station",
    "compare_vision",
    "depth",
    "load_object",
    "modes",
    "open_station",
    "render_audio",
    "render_vision",
    "tactile_image",
    "take_picture",
    "verify_object",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return __all__
