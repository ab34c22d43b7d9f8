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
    from harness.tasks.runs import ComparedRun, RunResult, RunWatcher, answer, compare, replay, run
    from harness.tasks.scenes import SceneOptions
    from harness.tasks.touch import RenderedTouch, render_touch, tactile_image
    from harness.tasks.vision import ComparedVision, RenderedVision, compare_vision, render_vision

_NAMES = {
    "calibration.taxim.result": ("TaximResult", "calibrate_taxim"),
    "harness.tasks.audio": ("RenderedAudio", "render_audio"),
    "harness.tasks.bench": ("StationCheck", "TakenPicture", "check_station", "open_station", "take_picture"),
    "harness.tasks.depth": ("PressDepth", "depth"),
    "harness.tasks.modes": ("modes",),
    "harness.tasks.objects": (
        "AudioBuild",
        "TouchBuild",
        "VerifiedObject",
        "VisionBuild",
        "build_objectfile",
        "load_object",
        "verify_object",
    ),
    "harness.tasks.runs": ("ComparedRun", "RunResult", "RunWatcher", "answer", "compare", "replay", "run"),
    "harness.tasks.scenes": ("SceneOptions",),
    "harness.tasks.touch": ("RenderedTouch", "render_touch", "tactile_image"),
    "harness.tasks.vision": ("ComparedVision", "RenderedVision", "compare_vision", "render_vision"),
}
"""Module to the names that it defines."""

_HOMES = {name: module for module, names in _NAMES.items() for name in names}

__all__ = [
    "AudioBuild",
    "ComparedRun",
    "ComparedVision",
    "PressDepth",
    "RenderedAudio",
    "RenderedTouch",
    "RenderedVision",
    "RunResult",
    "RunWatcher",
    "SceneOptions",
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
    "compare",
    "compare_vision",
    "depth",
    "load_object",
    "modes",
    "open_station",
    "render_audio",
    "render_touch",
    "render_vision",
    "replay",
    "run",
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
