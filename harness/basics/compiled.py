"""Loops compiled by numba, with the machine code kept in the user's cache folder.

numba keeps machine code next to the source file and does not notice when a kernel of another module that was
compiled into it has changed. Here the key is a hash of everything that the machine code depends on. So every
checkout and installed copy of the same sources shares one cache, and an edited callee is compiled again.
"""

import contextlib
import fcntl
import functools
import hashlib
import inspect
import os
import shutil
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any, TypeVar, cast

import numba
import numpy as np
from numba.core.caching import CompileResultCacheImpl, FunctionCache, _CacheLocator

from harness.basics.arrays import AnyArray
from harness.basics.store import default_folder

_F = TypeVar("_F", bound=Callable[..., Any])

_REORDERED = {"contract", "arcp", "nsz", "reassoc"}
"""Floating-point rules of LLVM that only change rounding: infinities and NaN keep their meaning."""

MAX_SOURCE_VERSIONS = 16
"""Versions of one module's sources whose machine code is kept; the oldest is deleted."""


def compiled(function: _F) -> _F:
    """Compile a function on its first call, without holding the interpreter's lock while it runs."""
    return _kept(function, numba.njit(nogil=True)(function))


def inlined(function: _F) -> _F:
    """Compile as ``compiled`` does, and copy the code into its callers: for kernels with many arguments."""
    return _kept(function, numba.njit(inline="always", nogil=True)(function))


def compiled_fast(function: _F) -> _F:
    """Compile as ``compiled`` does, free to reorder sums and fuse products: for levels that state an error.

    Infinities and NaN keep their meaning; only rounding may differ. It may differ from one process to the
    next: a kernel that was just compiled and the same one from disk may call different copies of a function.
    Where a last digit can decide which of two answers is given, use ``compiled``.
    """
    return _kept(function, numba.njit(nogil=True, fastmath=_REORDERED)(function))


@functools.cache
def source_stamp(function: Callable[..., Any]) -> str:
    """Hash the source file of a kernel and what it names of other files: kernels, constants, classes."""
    state = hashlib.sha256(_file_hash(inspect.getfile(function)))
    for name in sorted(_global_names(function.__code__)):
        if name in function.__globals__:
            state.update(f"{name} {_dependency(function.__globals__[name], function)}".encode())
    return state.hexdigest()


def _dependency(value: object, user: Callable[..., Any]) -> str:
    """Hash one global of a kernel; numba compiles its value into the machine code."""
    kernel = getattr(value, "py_func", None)
    if isinstance(kernel, FunctionType):
        # The file of the user is hashed already, and kernels of one file may call each other in a circle.
        return "" if kernel.__module__ == user.__module__ else source_stamp(kernel)
    if isinstance(value, np.ndarray):
        return hashlib.sha256(f"{value.dtype.str} {value.shape}".encode() + value.tobytes()).hexdigest()
    if isinstance(value, ModuleType | type):
        # Constants that are reached through a module, and the fields of a class.
        module = value if isinstance(value, ModuleType) else sys.modules.get(value.__module__)
        file = getattr(module, "__file__", None)
        return value.__name__ if file is None else _file_hash(file).hex()
    return repr(value)


def _global_names(code: CodeType) -> set[str]:
    inner = (_global_names(const) for const in code.co_consts if isinstance(const, CodeType))
    return set(code.co_names).union(*inner)


@functools.cache
def _file_hash(path: str) -> bytes:
    return hashlib.sha256(Path(path).read_bytes()).digest()


class _Locator(_CacheLocator):
    """The folder of a kernel's machine code: by module and hash of the sources."""

    def __init__(self, function: Callable[..., Any], file: str) -> None:
        # Names that numba's own messages use.
        self._py_file, self._lineno = file, function.__code__.co_firstlineno
        self._stamp = source_stamp(function)
        kernels = Path(os.environ.get("NUMBA_CACHE_DIR") or default_folder() / "kernels")
        self._module = kernels / function.__module__
        self._folder = self._module / self._stamp[:24]

    @classmethod
    def from_function(cls, py_func: Callable[..., Any], py_file: str) -> "_Locator":
        return cls(py_func, py_file)

    def get_cache_path(self) -> str:
        return str(self._folder)

    def get_source_stamp(self) -> str:
        return self._stamp

    def get_disambiguator(self) -> str:
        return str(self._lineno)

    def ensure_cache_path(self) -> None:
        self._folder.mkdir(parents=True, exist_ok=True)
        versions = sorted(self._module.iterdir(), key=lambda folder: folder.stat().st_mtime)
        for old in versions[:-MAX_SOURCE_VERSIONS]:
            shutil.rmtree(old, ignore_errors=True)

    @contextlib.contextmanager
    def locked(self) -> Iterator[None]:
        """Keep other processes from writing: numba names a new file after those in the index it read."""
        self.ensure_cache_path()
        descriptor = os.open(self._folder / "lock", os.O_CREAT | os.O_RDWR)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX)
            yield
        finally:
            os.close(descriptor)


class _KernelCacheImpl(CompileResultCacheImpl):
    _locator_classes: list[type[object]] = [_Locator]  # noqa: RUF012 - as numba declares it


class _KernelCache(FunctionCache):
    """Machine code on disk; a folder that cannot be read or written costs compile time and nothing else."""

    _impl_class = _KernelCacheImpl

    def load_overload(self, sig: object, target_context: object) -> Any:
        """Load the machine code of a signature; None if there is none that can be read."""
        try:
            return super().load_overload(sig, target_context)  # type: ignore[no-untyped-call]
        except Exception:  # noqa: BLE001 - a damaged pickle raises anything
            with contextlib.suppress(OSError), self._impl.locator.locked():
                self.flush()  # type: ignore[no-untyped-call]
            return None

    def save_overload(self, sig: object, data: object) -> None:
        """Write the machine code of a signature."""
        with contextlib.suppress(OSError), self._impl.locator.locked():
            super().save_overload(sig, data)  # type: ignore[no-untyped-call]


def _kept(function: _F, dispatcher: Any) -> _F:
    # As enable_caching of numba's dispatcher does, with its own class.
    dispatcher._cache = _KernelCache(function)  # type: ignore[no-untyped-call]  # noqa: SLF001
    return cast(_F, dispatcher)


@compiled
def copy_line(target: AnyArray, source: AnyArray) -> None:
    """Write ``(n,)`` values over the first n of ``target``, which is at least as long.

    In a kernel, ``target[:n] = source`` does the same, and takes seconds to compile: numba compiles the
    message about unequal shapes with it.
    """
    for i in range(len(source)):
        target[i] = source[i]
