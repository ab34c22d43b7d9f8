"""Estimate the shape during a run: after each press, from the hypotheses before it."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.family.settings import CONTINUED
from experiments.shape_reconstruction.methods import QUICK, continued, estimated
from experiments.shape_reconstruction.section import Choice
from experiments.shape_reconstruction.surface import ShapeEstimate
from harness.basics.errors import FitRefused

INFORMATIVE = "family, continued"
"""While the arm waits for a press that goes by which shapes are likely."""


class RunningShape:
    """Estimates after one press more each time.

    By ``INFORMATIVE`` each begins at the hypotheses of that before it and at a few draws of its own, from the
    first press on, whichever are asked for: a run that is resumed, or replayed, goes where it went. Where
    what is found fits ill, hypotheses before it may all be of a wrong form: it is begun anew beside them.

    Args:
        method: ``INFORMATIVE``, or a key of ``METHODS``, by which each estimate stands alone.
    """

    def __init__(self, method: str) -> None:
        self._method = method
        self._taken: int | None = None
        self._found: ShapeEstimate | None = None

    def after(self, evidence: ShapeEvidence) -> ShapeEstimate | None:
        """From all presses of some evidence; None where they say too little.

        Args:
            evidence: that of the last call and as many presses or more.
        """
        presses = len(evidence.touches)
        if presses != self._taken:
            first = 0 if self._taken is None else self._taken + 1
            for count in range(first if self._method == INFORMATIVE else presses, presses + 1):
                self._found = self._next(replace(evidence, touches=evidence.touches[:count]))
            self._taken = presses
        return self._found

    def _next(self, evidence: ShapeEvidence) -> ShapeEstimate | None:
        try:
            if self._method != INFORMATIVE:
                return estimated(self._method, evidence)
            settings = replace(CONTINUED, seed=len(evidence.touches))
            return continued(evidence, settings, self._found)
        except FitRefused:
            return None


MOST = 4
"""Presses up to which each has an estimate of its own; of more, those at powers of two and the last."""


@dataclass(frozen=True, eq=False)
class LiveEstimate:
    """What was known after a press."""

    presses: int  #: how many were made by then.
    evidence: ShapeEvidence  #: from them, and from the picture.
    estimate: ShapeEstimate | None  #: None where they said too little for one.


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
