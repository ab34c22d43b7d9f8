"""What every part of a report may hold: a posterior, or the reason why something is not there."""

from dataclasses import dataclass

from harness.basics.arrays import FloatArray


@dataclass(frozen=True)
class Missing:
    """Something the report would show and cannot, and why."""

    reason: str


@dataclass(frozen=True, eq=False)
class Posterior:
    """Where a contact may have been, as weighted places on the object.

    Attributes:
        points: ``(n, 3)`` metres, object frame.
        weights: ``(n,)``, not negative, any sum but zero.
        estimate: ``(3,)`` metres.
        modes: ``(k, 3)`` metres, separate likely places, best first.
        mode_weights: ``(k,)`` share of the posterior each holds.
        credible90: metres.
    """

    points: FloatArray
    weights: FloatArray
    estimate: FloatArray
    modes: FloatArray
    mode_weights: FloatArray
    credible90: float
