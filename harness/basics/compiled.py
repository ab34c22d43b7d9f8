"""Machine code for the loops that numpy would run as temporaries."""

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

from harness.basics.arrays import AnyArray

_F = TypeVar("_F", bound=Callable[..., Any])


def compiled(function: _F) -> _F:
    """The function compiled on first call, kept on disk, holding no lock while it runs."""
    return cast(_F, numba.njit(cache=True, nogil=True)(function))


@compiled
def copy_line(target: AnyArray, source: AnyArray) -> None:
    """Write ``(n,)`` values over the first n of ``target``, which is at least as long.

    In a kernel, ``target[:n] = source`` says the same, and costs seconds to compile: numba compiles the
    message about unequal shapes with it.
    """
    for i in range(len(source)):
        target[i] = source[i]


def inlined(function: _F) -> _F:
    """As ``compiled``, copied into what calls it: where its arguments are many, passing them costs more."""
    return cast(_F, numba.njit(inline="always", nogil=True, cache=True)(function))


def compiled_fast(function: _F) -> _F:
    """As ``compiled``, free to reorder sums and fuse products: for levels that state an error.

    Infinities and NaN keep their meaning; only rounding may differ. It may differ from one process to the
    next: a kernel that was just compiled and the same one from disk may call different copies of a function.
    Where a last digit can decide which of two answers is given, use ``compiled``.
    """
    flags = {"contract", "arcp", "nsz", "reassoc"}
    return cast(_F, numba.njit(cache=True, nogil=True, fastmath=flags)(function))
