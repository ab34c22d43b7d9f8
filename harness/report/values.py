"""What every part of a report may hold: a posterior, or the reason why something is not there."""

from dataclasses import dataclass

from harness.basics.arrays import FloatArray


@dataclass(frozen=True)
class Missing:
    """Something the report would show and cannot, and why."""

    reason: str


@dataclass(frozen=True, eq=False)
class Posterior:
    """Where a contact may have been, as weighted places on the object."""

    points: FloatArray  #: ``(n, 3)`` metres, object frame.
    weights: FloatArray  #: ``(n,)``, not negative, any sum but zero.
    estimate: FloatArray  #: ``(3,)`` metres.
    modes: FloatArray  #: ``(k, 3)`` metres, separate likely places, best first.
    mode_weights: FloatArray  #: ``(k,)`` share of the posterior each holds.
    credible90: float  #: metres.
