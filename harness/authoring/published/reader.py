"""Read a file of torch as plain tables of numpy arrays, without running anything in it.

torch's own restricted reader (``weights_only``) makes tensors, dictionaries and numbers. Published files also
hold numpy arrays, which a pickle builds by calling numpy's constructors and passing a state. numpy's own
constructors would take any dtype, objects and padded structures among them; the stand-ins below take
little-endian numbers and booleans, as many bytes as their shape has. Any other name in the file is refused.
"""

import math
import pickle
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from harness.basics.arrays import AnyArray
from harness.basics.errors import DataRefused, WrongUse
from harness.basics.files.foreign_file import (
    MOST_DATA,
    refused_as,
    require_readable,
    require_unpackable,
)
from harness.basics.files.named_file import require_file

Tree = Any
"""Tables (``dict`` with text or whole numbers as keys), lists, arrays, numbers, text, None."""

_MAX_PICKLE_BYTES = 2**24
"""Bytes of ``data.pkl``, which is read one operation at a time; tensors are not in it."""

_MAX_ITEMS = 10**6
"""Entries of all tables and lists together, counted as often as they are referred to."""

_DEEPEST = 8
"""Tables within tables."""

_FOREIGN = "it is no ObjectFile of ObjectFolder; give the .pth as it was published"


def read_container(path: Path) -> Tree:
    """What a ``.pth`` file holds.

    Raises:
        WrongUse: there is no such file, or torch is not installed.
        DataRefused: it is foreign or cut short, or asks for code to be run.
    """
    require_file(path, "file", "give a published ObjectFile, a .pth file")
    # Checked before torch opens it: a truncated file has lost the directory at its end.
    require_readable(path, "an ObjectFile", MOST_DATA)
    with path.open("rb") as stream:
        if stream.read(2) != b"PK":
            raise DataRefused(f"{path.name} is no archive of torch (of 1.6 or later); {_FOREIGN}")
    with refused_as(DataRefused, f"{path.name} is damaged or cut short; copy or download it again"):
        require_unpackable(path, "an ObjectFile")
        with zipfile.ZipFile(path) as archive:
            listed = archive.infolist()
    pickled = sum(item.file_size for item in listed if item.filename.endswith(".pkl"))
    if pickled > _MAX_PICKLE_BYTES:
        raise DataRefused(
            f"{path.name} has a pickle of {pickled / 2**20:.0f} MiB, at most {_MAX_PICKLE_BYTES / 2**20:.0f} "
            f"MiB may be; {_FOREIGN}"
        )
    if not any(item.filename.endswith("data.pkl") for item in listed):
        raise DataRefused(f"{path.name} is an archive without torch's data.pkl; {_FOREIGN}")
    return plain_tree(_loaded(path), path.name)


def _loaded(path: Path) -> Any:
    if any(find_spec(name) is None for name in ("torch", "onnxscript")):
        raise WrongUse(
            "importing a .pth file needs torch and onnxscript, which are in the extra `author`: pip install "
            "'.[author]'"
        )
    import torch

    try:
        with torch.serialization.safe_globals(list(ALLOWED)):
            return torch.load(path, map_location="cpu", weights_only=True)
    except pickle.UnpicklingError as error:
        raise DataRefused(
            f"{path.name} asks for what no ObjectFile needs, and nothing of it was run ({_reason(error)}); "
            f"{_FOREIGN}"
        ) from error
    except Exception as error:
        # torch raises whatever its reader met: KeyError, RuntimeError, EOFError for one damaged file.
        raise DataRefused(f"{path.name} is damaged or cut short; copy or download it again") from error


def _reason(error: Exception) -> str:
    """The cause in one line: torch's advice is to trust the file, and the cause stands behind it."""
    text = " ".join(str(error).split())
    said = text.rpartition("WeightsUnpickler error:")[2] or text
    return said.strip().split(". ")[0][:160] or type(error).__name__


@dataclass
class Budget:
    """Remaining limits of a tree."""

    items: int = _MAX_ITEMS
    bytes: int = MOST_DATA

    def take(self, where: str, items: int, size: int = 0) -> None:
        """Count entries and bytes of arrays; refuse what is too many."""
        self.items, self.bytes = self.items - items, self.bytes - size
        if self.items < 0:
            raise DataRefused(f"{where}: the file holds more than {_MAX_ITEMS} entries; {_FOREIGN}")
        if self.bytes < 0:
            raise DataRefused(
                f"{where}: the arrays of the file take more than {MOST_DATA / 2**20:.0f} MiB; {_FOREIGN}"
            )


def plain_tree(value: Any, where: str, depth: int = 0, budget: Budget | None = None) -> Tree:
    """Convert to tables, lists, arrays of numbers, numbers and text; anything else is refused.

    Args:
        value: as it was loaded; what it refers to twice counts twice.
        where: for messages.
        depth: number of tables around it.
        budget: what the whole tree may still hold.

    Raises:
        DataRefused: naming the place.
    """
    budget = budget or Budget()
    if depth > _DEEPEST:
        raise DataRefused(f"{where} lies deeper than any table of an ObjectFile; {_FOREIGN}")
    match value:
        case None | bool() | int() | float() | str():
            return value
        case Mapping():
            budget.take(where, len(value))
            for key in value:
                if not isinstance(key, str | int):
                    raise DataRefused(f"{where} has a key that is a {type(key).__name__}; {_FOREIGN}")
            return {
                key: plain_tree(item, f"{where}[{key!r}]", depth + 1, budget) for key, item in value.items()
            }
        case list() | tuple():
            budget.take(where, len(value))
            return [plain_tree(item, f"{where}[{k}]", depth + 1, budget) for k, item in enumerate(value)]
        case PickledArray() if value.array is not None:
            budget.take(where, 0, value.array.nbytes)
            return value.array
    if hasattr(value, "detach") and hasattr(value, "numel"):
        return _of_tensor(value, where, budget)
    raise DataRefused(f"{where} is a {type(value).__name__}, of which an ObjectFile has none; {_FOREIGN}")


def _of_tensor(tensor: Any, where: str, budget: Budget) -> AnyArray:
    # A view may be far larger than what is stored, and bfloat16 becomes float32.
    budget.take(where, 0, tensor.numel() * max(4, tensor.element_size()))
    try:
        found = tensor.detach().contiguous()
        plain = found.float() if str(found.dtype) == "torch.bfloat16" else found
        array: AnyArray = np.array(plain.numpy())
    except (TypeError, RuntimeError) as error:
        raise DataRefused(
            f"{where} is a tensor that is no plain array ({_reason(error)}); {_FOREIGN}"
        ) from error
    return array


_CODES = frozenset({"b1", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8", "f2", "f4", "f8"})

MOST_NUMBERS = 2**28
"""Of one array; the largest published one has 17 million."""


class PickledDtype:
    """A dtype of plain numbers (``numpy.dtype(code, align, copy)``)."""

    def __init__(self, code: Any, *_: Any) -> None:
        if code not in _CODES:
            raise pickle.UnpicklingError(f"numbers of the kind {code!r}")
        self.dtype = np.dtype("<" + code)

    def __setstate__(self, state: Any) -> None:
        order = state[1] if isinstance(state, tuple) and len(state) > 1 else None
        if order not in ("<", "|", "="):
            raise pickle.UnpicklingError(f"numbers of the byte order {order!r}")


class PickledArray:
    """An array of plain numbers, created empty (``numpy.core.multiarray._reconstruct``), then filled."""

    def __init__(self, *_: Any) -> None:
        self.array: AnyArray | None = None  #: None before.

    def __setstate__(self, state: Any) -> None:
        if not (isinstance(state, tuple) and len(state) == 5 and isinstance(state[2], PickledDtype)):
            raise pickle.UnpicklingError("an array whose state is none")
        _, shape, kind, fortran, data = state
        self.array = _filled(shape, kind, data, "F" if fortran else "C")


def scalar(kind: Any, data: Any) -> Any:
    """``numpy.core.multiarray.scalar``: one number, as Python's."""
    if not isinstance(kind, PickledDtype):
        raise pickle.UnpicklingError("a scalar without a kind")
    return _filled((), kind, data, "C").item()


class ArrayName:
    """``numpy.ndarray``, as ``PickledArray`` is given it: a name, not to be called."""

    def __new__(cls, *_: Any) -> "ArrayName":
        """Refuse."""
        raise pickle.UnpicklingError("an array made by its class")


ALLOWED: tuple[tuple[Any, str], ...] = (
    (PickledArray, "numpy.core.multiarray._reconstruct"),
    (PickledArray, "numpy._core.multiarray._reconstruct"),
    (scalar, "numpy.core.multiarray.scalar"),
    (scalar, "numpy._core.multiarray.scalar"),
    (PickledDtype, "numpy.dtype"),
    (ArrayName, "numpy.ndarray"),
)
"""What a published file may name beside torch's own tensors, and what is called instead."""


def _filled(shape: Any, kind: PickledDtype, data: Any, order: Any) -> AnyArray:
    sizes = isinstance(shape, tuple) and all(
        type(size) is int and 0 <= size <= MOST_NUMBERS for size in shape
    )
    if not sizes or not isinstance(data, bytes) or math.prod(shape) > MOST_NUMBERS:
        raise pickle.UnpicklingError(f"an array of the shape {shape!r}")
    if len(data) != math.prod(shape) * kind.dtype.itemsize:
        raise pickle.UnpicklingError(f"{len(data)} bytes for an array {shape!r} of {kind.dtype}")
    return np.frombuffer(data, kind.dtype).reshape(shape, order=order)
