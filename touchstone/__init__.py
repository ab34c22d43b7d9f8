"""Touchstone from Python: ``import touchstone``. The functions are those of ``harness.api``.

This is the one ``__init__`` with code: it hands on names without importing what defines them.
"""

from typing import TYPE_CHECKING, Any

from harness import api

if TYPE_CHECKING:
    from calibration.taxim.result import TaximResult, calibrate_taxim
    from harness.api import (
        AudioBuild,
        ComparedVision,
        PressDepth,
        RenderedAudio,
        RenderedVision,
        StationCheck,
        TakenPicture,
        TouchBuild,
        VerifiedObject,
        VisionBuild,
        answer,
        build_objectfile,
        check_station,
        compare_vision,
        depth,
        load_object,
        modes,
        open_station,
        render_audio,
        render_vision,
        tactile_image,
        take_picture,
        verify_object,
    )

__all__ = [
    "AudioBuild",
    "ComparedVision",
    "PressDepth",
    "RenderedAudio",
    "RenderedVision",
    "StationCheck",
    "TakenPicture",
    "TaximResult",
    "TouchBuild",
    "VerifiedObject",
    "VisionBuild",
    "answer",
    "build_objectfile",
    "calibrate_taxim",
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
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(api, name)


def __dir__() -> list[str]:
    return __all__
