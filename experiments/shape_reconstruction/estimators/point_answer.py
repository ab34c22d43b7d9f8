"""An answer in points: places of a surface that nobody says how they hang together."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from experiments.shape_reconstruction.estimators.contact_samples import all_samples
from experiments.shape_reconstruction.evidence import ShapeEvidence
from harness.basics.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class PointEstimate:
    """Places of an object's surface."""

    points: FloatArray  #: ``(n, 3)`` m in ``stand``.
    seconds: float  #: of the estimate.
    details: Mapping[str, object] = field(default_factory=dict)
    """JSON values of what the estimator found beside."""


def by_raw_points(evidence: ShapeEvidence) -> PointEstimate:
    """The places that were met and nothing else: what any estimator must beat.

    Raises:
        FitRefused: no touch met the object.
    """
    return PointEstimate(all_samples(evidence).points, 0.0, {"estimator": "points"})
