"""The result of an estimator of shape: a watertight surface with the uncertainty of each of its parts."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.mesh import Mesh

UNOBSERVED, SEEN, TOUCHED = 0, 1, 2
"""Sources of a vertex: neither touched nor at the border of the silhouette; seen; under a gel."""


@dataclass(frozen=True, eq=False)
class ShapeEstimate:
    """The surface of an object, by one estimator."""

    mesh: Mesh  #: watertight, in the frame ``stand``, metres.
    deviation: FloatArray  #: ``(vertices,)`` m, one standard deviation of the surface along its normal.
    known_by: IntArray  #: ``(vertices,)`` ``UNOBSERVED``, ``SEEN`` or ``TOUCHED``.
    not_bounded: tuple[str, ...]
    """names of the extents that no reading limits: ``"x"``, ``"y"``, ``"z"`` of ``stand``."""
    doubtful: Mapping[int, float]
    """indices of the touches that do not fit the rest, with m that each is off."""
    flags: tuple[str, ...]  #: short sentences that the answer must carry: ``"class unknown: mug or can"``.
    seconds: float  #: duration of the estimate.
    estimator: str  #: name of the estimator.
    counts: Mapping[str, int] = field(default_factory=dict)
    """numbers of readings and points that it is made from, by their names in the result."""

    def details(self) -> dict[str, object]:
        """Return JSON values of the result besides the surface."""
        return {"estimator": self.estimator, **self.counts}
