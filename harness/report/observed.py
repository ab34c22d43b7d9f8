"""What a scene observes, as rows of a page: each quantity's shape and range."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from harness.experiment.compare import Comparison


@dataclass(frozen=True)
class Observed:
    """A simulated quantity that the scene asked for.

    Attributes:
        name: of the effect that provides it, and of a part of it.
        shape: of the array; what it is where it is none.
        least: of its numbers; None where it has none.
        mean: likewise.
        most: likewise.
    """

    name: str
    shape: str
    least: float | None = None
    mean: float | None = None
    most: float | None = None


def observed_rows(comparison: Comparison) -> tuple[Observed, ...]:
    """A row for every quantity that the scene observes, and for every part of one."""
    return tuple(row for name, said in comparison.observed().items() for row in _rows(name, said))


def _rows(name: str, said: Mapping[str, Any]) -> Iterator[Observed]:
    if "parts" in said:
        for part, inner in said["parts"].items():
            yield from _rows(f"{name}: {part}", inner)
    elif "shape" in said:
        shape = " x ".join(str(length) for length in said["shape"]) or "one number"
        yield Observed(name, shape, said.get("least"), said.get("mean"), said.get("most"))
    else:
        yield Observed(name, said["kind"])
