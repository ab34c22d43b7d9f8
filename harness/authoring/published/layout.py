"""A published file's tables, read by their names: what is missing or of another shape is refused."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.errors import DataRefused
from harness.objectfile.graph import MlpWeights
from harness.objectfile.published.entries import Format

_PREFIX = "module."
"""That torch's DataParallel puts before every name."""

_LAYERS = 8
_SKIP = 5
"""The layer, from 0, that takes the encoded input again, of sound and touch of both versions."""

DEAD = "views_linears."
"""Layers that the published networks of sound and touch are saved with and never use."""


@dataclass(frozen=True, eq=False)
class FileTable:
    """A table of the file.

    Attributes:
        name: where it is, for messages.
        values: of it.
    """

    name: str
    values: Mapping[str, Any]

    def part(self, key: str) -> "FileTable":
        """A table within; ``DataRefused`` where there is none."""
        found = self.values.get(key)
        if not isinstance(found, Mapping):
            raise DataRefused(
                f"{self.name} has no table {key!r}; it is no ObjectFile as ObjectFolder publishes them"
            )
        return FileTable(f"{self.name}/{key}", found)

    def array(self, key: str, shape: tuple[int | None, ...]) -> FloatArray:
        """Finite numbers of a shape, None for any size from 1 up, float64; ``DataRefused`` for others."""
        value = self.values.get(key)
        if not isinstance(value, np.ndarray | int | float | list):
            raise DataRefused(
                f"{self.name} has no numbers {key!r}; it is no ObjectFile as ObjectFolder publishes them"
            )
        return checked(value, shape, f"{self.name}/{key}")

    def number(self, key: str) -> float:
        """One finite number."""
        return float(self.numbers(key, 1)[0])

    def numbers(self, key: str, count: int) -> FloatArray:
        """``(count,)`` float64, of one number for all, or of as many in any shape."""
        value = self.values.get(key)
        if not isinstance(value, np.ndarray | int | float | list) or isinstance(value, bool):
            raise DataRefused(
                f"{self.name} has no number {key!r}; it is no ObjectFile as ObjectFolder publishes them"
            )
        flat = checked(np.asarray(value).ravel(), (None,), f"{self.name}/{key}")
        if flat.size not in (1, count):
            raise DataRefused(f"{self.name}/{key} has {flat.size} numbers, where there is 1, or {count}")
        return np.array(np.broadcast_to(flat, (count,)))


def checked(value: Any, shape: tuple[int | None, ...], name: str) -> FloatArray:
    """Finite float64 of a shape; ``DataRefused`` for others, or for text."""
    try:
        array = np.asarray(value)
    except ValueError as error:
        raise DataRefused(f"{name} is no array") from error
    if array.dtype.kind not in "fiub" or not _fits(array.shape, shape):
        wanted = " x ".join("n" if size is None else str(size) for size in shape) or "one number"
        raise DataRefused(f"{name} holds {array.dtype} {array.shape}, where {wanted} belongs")
    numbers = array.astype(np.float64)
    if not np.isfinite(numbers).all():
        bad = int(np.count_nonzero(~np.isfinite(numbers)))
        raise DataRefused(
            f"{name} has {bad} of {numbers.size} numbers that are not finite; get the file again"
        )
    return numbers


def format_of(tree: Any, name: str) -> Format:
    """Which version published it.

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
            "ObjectFile is "
            "of one version, 1.0 or 2.0"
        )
    return found.pop()


@dataclass(eq=False)
class State:
    """The weights of a network, by name; names that nobody asked for are not dropped in silence.

    Attributes:
        name: where it is, for messages.
        values: by names without torch's prefix.
        used: names that were asked for.
    """

    name: str
    values: Mapping[str, Any]
    used: set[str] = field(default_factory=set)

    @classmethod
    def of(cls, part: FileTable, key: str) -> "State":
        """The state of a key.

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

    def has(self, prefix: str) -> bool:
        """Whether a name begins so."""
        return any(name.startswith(prefix) for name in self.values)

    def weights(self, layer: str, dimensions: int) -> tuple[AnyArray, AnyArray]:
        """``weight`` and ``bias`` of a layer as they are held: so many axes and one less."""
        found = []
        for kind, axes in (("weight", dimensions), ("bias", dimensions - 1)):
            name = f"{layer}.{kind}"
            if name not in self.values:
                raise DataRefused(
                    f"{self.name} has no {name!r}; it is no network as ObjectFolder publishes them"
                )
            self.used.add(name)
            found.append(checked(self.values[name], (None,) * axes, f"{self.name}/{name}").astype(np.float32))
        return found[0], found[1]

    def linear(self, layer: str) -> tuple[AnyArray, AnyArray]:
        """``(in, out)`` and ``(out,)`` of a torch layer, which holds ``(out, in)``."""
        weight, bias = self.weights(layer, 2)
        return weight.T, bias

    def perceptron(self, prefix: str = "") -> MlpWeights:
        """The published perceptron: eight layers, the input again at the sixth, and the output."""
        layers = [self.linear(f"{prefix}pts_linears.{k}") for k in range(_LAYERS)]
        return MlpWeights((*layers, self.linear(f"{prefix}output_linear")), (_SKIP,))

    def dropped(self) -> dict[str, int]:
        """Numbers that nothing uses, by name.

        Raises:
            DataRefused: others than the known dead layers: a layout that is not known.
        """
        rest = [name for name in self.values if name not in self.used]
        foreign = [name for name in rest if DEAD not in name]
        if foreign:
            raise DataRefused(
                f"{self.name} has weights {foreign[:3]} that the published program does not know; it is of "
                "another "
                "layout, and reading the rest would be a guess"
            )
        return {f"{self.name}/{name}": math.prod(np.shape(self.values[name])) for name in rest}


def _fits(found: tuple[int, ...], shape: tuple[int | None, ...]) -> bool:
    if len(found) != len(shape):
        return False
    return all(
        size >= 1 if wanted is None else size == wanted for size, wanted in zip(found, shape, strict=True)
    )
