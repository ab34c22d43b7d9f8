"""Touchstone from Python: ``import touchstone``. The functions are those of ``harness.api``.

This is the one ``__init__`` with code: it hands on names without importing what defines them.
"""

from typing import TYPE_CHECKING, Any

from harness import api

if TYPE_CHECKING:
    from calibration.taxim.result import TaximResult as TaximResult
    from calibration.taxim.result import calibrate_taxim as calibrate_taxim
    from harness.api import *  # noqa: F403 - the names of its __all__

__all__: list[str] = []
__all__ += api.__all__


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(api, name)


def __dir__() -> list[str]:
    return __all__
