"""Tables and weights of a published file, read by name; what is missing or has another shape is refused."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.errors import DataRefused
from harness.objectfile.published.entries import Format

_PREFIX = "module."
"""Prefix that torch's DataParallel puts before every name."""

_UNUSED = "views_linears."
"""Layers that the published networks of sound and touch are saved with and never use."""


@dataclass(frozen=True, eq=False)
class FileTable:
    """A table of the file."""

    name: str  #: path of the table in the file, for messages.
    values: Mapping[str, Any]  #: entries by name.

    def part(self, key: str) -> "FileTable":
        """Return a table within; ``DataRefused`` where there is none."""
        found = self.values.get(key)
        if not isinstance(found, Mapping):
            raise DataRefused(
                f"{self.name} has no table {key!r}; it is no ObjectFile as ObjectFolder publishes them"
            )
        return FileTable(f"{self.name}/{key}", found)

    def array(self, key: str, shape: tuple[int | None, ...]) -> FloatArray:
        """Return finite numbers of a shape, None for any size from 1 up; ``DataRefused`` for others."""
        value = self.values.get(key)
        if not isinstance(value, np.ndarray | int | float | list):
            raise DataRefused(
                f"{self.name} has no numbers {key!r}; it is no ObjectFile as ObjectFolder publishes them"
            )
        return checked(value, shape, f"{self.name}/{key}")

    def numbers(self, key: str, count: int) -> FloatArray:
        """Return ``(count,)`` float64 from one number for all, or from as many in any shape."""
        value = self.values.get(key)
        if not isinstance(value, np.ndarray | int | float | list) or isinstance(value, bool):
            raise DataRefused(
                f"{self.name} has no number {key!r}; it is no ObjectFile as ObjectFolder publishes them"
            )
        flat = checked(np.asarray(value).ravel(), (None,), f"{self.name}/{key}")
        if flat.size not in (1, count):
            raise DataRefused(f"{self.name}/{key} has {flat.size} numbers, where there is 1, or {count}")
        return np.array(np.broadcast_to(flat, (count,)))

    def number(self, key: str) -> float:
        """Return one finite number."""
        return float(self.numbers(key, 1)[0])

    def whole(self, key: str, most: int, least: int = 1) -> int:
        """Return a whole number within limits; ``DataRefused`` for others."""
        number = self.number(key)
        if number != round(number) or not least <= number <= most:
            raise DataRefused(f"{self.name}/{key} is {number:g}, not a whole number from {least} to {most}")
        return int(number)

    def sizes(self, key: str, most: int) -> tuple[int, int, int]:
        """Return whole numbers along x, y and z, from 1; ``DataRefused`` for others."""
        x, y, z = self.array(key, (3,)).tolist()
        if not all(size == round(size) and 1 <= size <= most for size in (x, y, z)):
            raise DataRefused(f"{self.name}/{key} is {[x, y, z]}, not three whole numbers from 1 to {most}")
        return int(x), int(y), int(z)

    def flag(self, key: str) -> bool:
        """Return true or false, which is what a missing one is."""
        value = self.values.get(key, False)
        if not isinstance(value, bool | int):
            raise DataRefused(f"{self.name}/{key} is {value!r}, where true or false belongs")
        return bool(value)


def checked(
    value: Any, shape: tuple[int | None, ...], name: str, kind: type[np.floating[Any]] = np.float64
) -> FloatArray:
    """Convert to finite numbers of a shape; ``DataRefused`` for other shapes, or for text."""
    try:
        array = np.asarray(value)
    except ValueError as error:
        raise DataRefused(f"{name} is no array") from error
    fits = len(array.shape) == len(shape) and all(
        size >= 1 if wanted is None else size == wanted
        for size, wanted in zip(array.shape, shape, strict=True)
    )
    if array.dtype.kind not in "fiub" or not fits:
        wanted = " x ".join("n" if size is None else str(size) for size in shape) or "one number"
        raise DataRefused(f"{name} holds {array.dtype} {array.shape}, where {wanted} belongs")
    with np.errstate(over="ignore", under="ignore"):
        numbers: FloatArray = array.astype(kind)
    if not np.isfinite(numbers).all():
        bad = int(np.count_nonzero(~np.isfinite(numbers)))
        raise DataRefused(
            f"{name} has {bad} of {numbers.size} numbers that are not finite; get the file again"
        )
    return numbers


def format_of(tree: Any, name: str) -> Format:
    """Determine which version published a file.

    Raises:
        DataRefused: neither.
    """
    senses = [
        key for key in ("VisionNet", "AudioNet", "TouchNet") if isinstance(tree, Mapping) and key in tree
    ]
    if not senses:
        held = sorted(map(str, tree))[:5] if isinstance(tree, Mapping) else type(tree).__name__
        raise DataRefused(
            f"{name} holds {held} and neither VisionNet, AudioNet nor TouchNet: it is no ObjectFile of "
            "ObjectFolder"
        )
    marks = (("VisionNet", "cfg", "network_fn_state_dict"), ("AudioNet", "frequencies", "voxel_vertex"),
             ("TouchNet", "xyz_min", None))  # fmt: skip
    found: set[Format] = set()
    for sense, second, first in marks:
        table = tree.get(sense)
        if isinstance(table, Mapping):
            if second in table:
                found.add("ObjectFolder 2.0")
            elif first is None or first in table:
                found.add("ObjectFolder 1.0")
    if len(found) != 1:
        raise DataRefused(
            f"{name} has {', '.join(senses)} of {' and '.join(sorted(found)) or 'no known layout'}; an "
            "ObjectFile is of one version, 1.0 or 2.0"
        )
    return found.pop()


@dataclass(eq=False)
class State:
    """The weights of a network by name; names that no layer reads are reported, not ignored."""

    name: str  #: path of the weights in the file, for messages.
    values: Mapping[str, Any]  #: arrays by name, without torch's prefix.
    used: set[str] = field(default_factory=set)  #: names that were read.

    @classmethod
    def of(cls, part: FileTable, key: str) -> "State":
        """Return the weights of a key.

        The prefix goes where every name has it, and then wherever it stands, as in the published programs.
        """
        table = part.part(key)
        names = [str(name) for name in table.values]
        prefixed = bool(names) and all(name.startswith(_PREFIX) for name in names)
        values = {name.replace(_PREFIX, "") if prefixed else name: value
                  for name, value in zip(names, table.values.values(), strict=True)}  # fmt: skip
        if len(values) != len(names):
            raise DataRefused(f"{table.name} has two weights of one name behind {_PREFIX!r}")
        return cls(table.name, values)

    def array(self, name: str, axes: int) -> AnyArray:
        """Return the float32 weights of a name; numbers too small for normal float32 become zero."""
        if name not in self.values:
            raise DataRefused(f"{self.name} has no {name!r}; it is no network as ObjectFolder publishes them")
        self.used.add(name)
        array = checked(self.values[name], (None,) * axes, f"{self.name}/{name}", np.float32)
        # Subnormal weights are noise, and slow every product they enter.
        array[np.abs(array) < np.finfo(np.float32).smallest_normal] = 0.0
        return array

    def outputs(self, layer: str, axes: int = 1) -> int:
        """Return the number of outputs of a layer, whose bias has so many axes."""
        return int(self.array(f"{layer}.bias", axes).shape[-1])

    def unused(self) -> dict[str, int]:
        """Count the numbers that nothing uses, by name.

        Raises:
            DataRefused: others than the known unused layers: a layout that is not known.
        """
        rest = [name for name in self.values if name not in self.used]
        foreign = [name for name in rest if _UNUSED not in name]
        if foreign:
            raise DataRefused(
                f"{self.name} has weights {foreign[:3]} that the published program does not know; it is of "
                "another layout, and reading the rest would be a guess"
            )
        return {f"{self.name}/{name}": math.prod(np.shape(self.values[name])) for name in rest}
