"""Tables and weights of a published file, and the parts of an imported folder.

Entries are read by name; those that are missing or have another shape are refused.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.errors import DataRefused
from harness.objectfile.entries import Input, NetworkEntry, Tensor
from harness.objectfile.network_part import NetworkPart, network_entry
from harness.objectfile.published.entries import Format

_PREFIX = "module."
"""Prefix that torch's DataParallel puts before every name."""

_UNUSED = "views_linears."
"""Layers that the published networks of sound and touch are saved with and never use."""

_FOREIGN = "it is no ObjectFile as ObjectFolder publishes them"

_MARKS = {
    "VisionNet": ("cfg", "network_fn_state_dict"),
    "AudioNet": ("frequencies", "voxel_vertex"),
    "TouchNet": ("xyz_min", "model_state_dict"),
}
"""The key that tells version 2.0, else the key that tells version 1.0, by the networks of a file."""


@dataclass(frozen=True, eq=False)
class FileTable:
    """A table of the file."""

    name: str  #: path of the table in the file, for messages.
    values: Mapping[str, Any]  #: entries by name.

    def part(self, key: str) -> "FileTable":
        """Return a table within; ``DataRefused`` where there is none."""
        found = self.values.get(key)
        if not isinstance(found, Mapping):
            raise DataRefused(f"{self.name} has no table {key!r}; {_FOREIGN}")
        return FileTable(f"{self.name}/{key}", found)

    def array(
        self,
        key: str,
        shape: tuple[int | None, ...] | None = None,
        kind: type[np.floating[Any]] = np.float64,
    ) -> FloatArray:
        """Return finite numbers of a shape; ``DataRefused`` for other shapes, or for text.

        Args:
            key: name of the entry.
            shape: sizes, None for any size from 1 up; None for any shape.
            kind: type of the numbers returned.
        """
        if key not in self.values:
            raise DataRefused(f"{self.name} has no {key!r}; {_FOREIGN}")
        name = f"{self.name}/{key}"
        try:
            array = np.asarray(self.values[key])
        except ValueError as error:
            raise DataRefused(f"{name} is no array") from error
        wanted = array.shape if shape is None else shape
        fits = len(array.shape) == len(wanted) and all(
            found >= 1 if size is None else found == size
            for found, size in zip(array.shape, wanted, strict=True)
        )
        if array.dtype.kind not in "fiub" or not fits:
            sizes = " x ".join("n" if size is None else str(size) for size in wanted) or "one number"
            raise DataRefused(f"{name} holds {array.dtype} {array.shape}, where {sizes} belongs")
        with np.errstate(over="ignore", under="ignore"):
            numbers: FloatArray = array.astype(kind)
        if not np.isfinite(numbers).all():
            bad = int(np.count_nonzero(~np.isfinite(numbers)))
            raise DataRefused(
                f"{name} has {bad} of {numbers.size} numbers that are not finite; get the file again"
            )
        return numbers

    def numbers(self, key: str, count: int = 1) -> FloatArray:
        """Return ``(count,)`` float64 from one number for all, or from as many in any shape."""
        flat = self.array(key).ravel()
        # A grid of occupied cells may hold true and false; a quantity may not.
        if np.asarray(self.values[key]).dtype == np.bool_:
            raise DataRefused(f"{self.name}/{key} is {self.values[key]}, where a number belongs")
        if flat.size not in (1, count):
            raise DataRefused(f"{self.name}/{key} has {flat.size} numbers, where there is 1, or {count}")
        return np.array(np.broadcast_to(flat, (count,)))

    def wholes(self, key: str, count: int, most: int, least: int = 1) -> tuple[int, ...]:
        """Return ``count`` whole numbers within limits; ``DataRefused`` for others."""
        numbers = self.numbers(key, count).tolist()
        if not all(number == round(number) and least <= number <= most for number in numbers):
            raise DataRefused(f"{self.name}/{key} is {numbers}, not whole numbers from {least} to {most}")
        return tuple(map(int, numbers))

    def whole(self, key: str, most: int, least: int = 1) -> int:
        """Return one whole number within limits."""
        return self.wholes(key, 1, most, least)[0]

    def flag(self, key: str) -> bool:
        """Return true or false, which is what a missing one is."""
        value = self.values.get(key, False)
        return value if isinstance(value, bool) else self.whole(key, 1, least=0) == 1

    def box(self) -> tuple[FloatArray, FloatArray]:
        """Return the ``(3,)`` least and greatest corner of the box that a network was trained in."""
        low, high = (self.numbers(key, 3) for key in ("xyz_min", "xyz_max"))
        if not (high > low).all():
            raise DataRefused(f"{self.name}: a box from {low} to {high} has no extent along some axis")
        return low, high


def format_of(tree: Any, name: str) -> Format:
    """Determine which version published a file.

    Raises:
        DataRefused: neither.
    """
    table = tree if isinstance(tree, Mapping) else {}
    senses = [key for key in _MARKS if key in table]
    if not senses:
        names = sorted(map(str, table))[:5] or type(tree).__name__
        raise DataRefused(
            f"{name} holds {names} and neither VisionNet, AudioNet nor TouchNet: it is no ObjectFile of "
            "ObjectFolder"
        )
    found: set[Format] = set()
    for sense in senses:
        second, first = _MARKS[sense]
        held = table[sense] if isinstance(table[sense], Mapping) else {}
        if second in held or first in held:
            found.add("ObjectFolder 2.0" if second in held else "ObjectFolder 1.0")
    if len(found) != 1:
        raise DataRefused(
            f"{name} has {', '.join(senses)} of {' and '.join(sorted(found)) or 'no known layout'}; an "
            "ObjectFile is of one version, 1.0 or 2.0"
        )
    return found.pop()


@dataclass(frozen=True, eq=False)
class State(FileTable):
    """The weights of a network by name, without torch's prefix; names that no layer reads are reported."""

    used: set[str] = field(default_factory=set)  #: names that were read.

    @classmethod
    def of(cls, part: FileTable, key: str) -> "State":
        """Return the weights of a key.

        The prefix goes where every name has it, and then wherever it stands, as in the published programs.
        """
        table = part.part(key)
        prefixed = all(str(name).startswith(_PREFIX) for name in table.values)
        values = {str(name).replace(_PREFIX, "") if prefixed else str(name): value
                  for name, value in table.values.items()}  # fmt: skip
        if len(values) != len(table.values):
            raise DataRefused(f"{table.name} has two weights of one name behind {_PREFIX!r}")
        return cls(table.name, values)

    def weights(self, name: str, axes: int) -> AnyArray:
        """Return the float32 weights of a name; numbers too small for normal float32 become zero."""
        array = self.array(name, (None,) * axes, np.float32)
        self.used.add(name)
        # Subnormal weights are noise, and slow every product they enter.
        array[np.abs(array) < np.finfo(np.float32).smallest_normal] = 0.0
        return array

    def outputs(self, layer: str, axes: int = 1) -> int:
        """Return the number of outputs of a layer, whose bias has so many axes."""
        return int(self.weights(f"{layer}.bias", axes).shape[-1])

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


_TOLERANCE = 1e-4
"""Tolerance of a self-test, relative to the greatest number: as for networks of ours."""

_TESTED = 4
"""Queries of a self-test."""


@dataclass(eq=False)
class ImportedParts:
    """Parts gathered while a file is read."""

    tree: dict[str, Any] = field(default_factory=dict)  #: tables of ``object.json``.
    contents: dict[str, bytes] = field(default_factory=dict)  #: bytes of files, by name.
    dropped: dict[str, int] = field(default_factory=dict)
    """numbers that the published programs never use, by name."""
    missing: list[str] = field(default_factory=list)  #: sentences on what the file does not hold.

    def network(
        self, file: str, module: Any, inputs: tuple[Input, ...], outputs: tuple[Tensor, ...], doc: str
    ) -> NetworkEntry:
        """Export a module into the contents, with a self-test of queries spread over the inputs' domains.

        Args:
            file: name of the graph's file.
            module: torch module.
            inputs: the module's inputs, in order.
            outputs: the module's outputs, in order.
            doc: description stored in the graph.

        Raises:
            DataRefused: a graph that must not be run.
        """
        from harness.authoring.published.modules import exported_graph

        graph, random, queries = exported_graph(module, inputs, outputs, doc), np.random.default_rng(0), {}
        for item in inputs:
            low, high = (np.array(bound, np.float64) for bound in (item.domain.low, item.domain.high))
            spread = low + random.random((_TESTED, low.size)) * (high - low)
            queries[item.name] = spread.reshape(_TESTED, *map(int, item.shape[1:])).astype(item.dtype)
        part = NetworkPart(file, graph, inputs, outputs, queries, _TOLERANCE)
        return network_entry(part, self.contents)
