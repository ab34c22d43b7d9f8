"""The shape as it was estimated while a run went on, after some of its presses."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.methods import QUICK
from experiments.shape_reconstruction.running import INFORMATIVE, RunningShape
from experiments.shape_reconstruction.section import Choice
from experiments.shape_reconstruction.surface import ShapeEstimate

MOST = 4
"""Presses up to which each has an estimate of its own; of more, those at powers of two and the last."""


@dataclass(frozen=True, eq=False)
class LiveEstimate:
    """What was known after a press.

    Attributes:
        presses: how many were made by then.
        evidence: from them, and from the picture.
        estimate: None where they said too little for one.
    """

    presses: int
    evidence: ShapeEvidence
    estimate: ShapeEstimate | None


def live_method(choose: Choice) -> str:
    """By which method the shape is estimated while the arm waits for its next press."""
    return INFORMATIVE if choose == "active" else QUICK


def live_estimates(evidence: ShapeEvidence, method: str) -> Iterator[LiveEstimate]:
    """The estimates after some of a run's presses, in their order.

    Args:
        evidence: of the whole run.
        method: as ``live_method`` names it.
    """
    running = RunningShape(method)
    for count in counts_shown(len(evidence.touches)):
        part = replace(evidence, touches=evidence.touches[:count])
        yield LiveEstimate(count, part, running.after(part))


def counts_shown(presses: int) -> list[int]:
    """After which of so many presses."""
    if presses <= MOST:
        return list(range(1, presses + 1))
    powers = [2**k for k in range(presses.bit_length()) if 2**k < presses]
    return [*powers, presses]
