"""Fitted surfaces that compete to be the answer, and how well each predicts readings left out of its fit."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from experiments.shape_reconstruction import thresholds as limits
from experiments.shape_reconstruction.family.freedom import NuisanceCost
from experiments.shape_reconstruction.family.posterior import Mixture
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


FOLDS = 8  #: parts in which contacts are left out: the time does not grow with their number.


@dataclass(frozen=True, eq=False, kw_only=True)
class FittedShape(ShapeEstimate):
    """A surface fitted to contacts."""

    left_out: FloatArray
    """``(contacts,)`` rms distance of each contact from the surface fitted without it, m."""
    outline_error: float = 0.0
    """fraction of the silhouette that the surface misses or adds; zero without a picture."""

    @property
    def misfit(self) -> float:
        """Negative log-likelihood of the left-out contacts, less a constant."""
        return float(np.log1p((self.left_out / limits.PREDICTION_SCALE) ** 2).sum())

    @property
    def prediction_error(self) -> float:
        """Root mean square of the left-out distances, m; zero without a contact."""
        return float(np.sqrt(np.mean(self.left_out**2))) if len(self.left_out) else 0.0


@dataclass(frozen=True, eq=False, kw_only=True)
class FamilyFit(FittedShape):
    """The surface of the shape family, and the hypotheses that it is the median of."""

    mixture: Mixture  #: hypotheses with their weights.
    contact_cost: float  #: median sum of squares of a contact, in standard deviations.
    other_cost: float  #: cost of free places, clear places of the gel and rays of sight.
    nuisance: NuisanceCost  #: bench errors that the best hypothesis needs.
    beyond_contacts: float  #: mean distance of the surface beyond the box of all contacts, m.
    sighted: bool  #: whether there was a silhouette.
    open_axes: tuple[str, ...] = ()  #: axes that no reading limits, the family not counted as one.

    def details(self) -> dict[str, object]:
        """Return JSON values of the result besides the surface."""
        return {
            "kind": self.estimator,
            "classes": self.mixture.by_class(),
            "cost": self.mixture.best.cost,
            "contact_cost": self.contact_cost,
            "other_cost": self.other_cost,
            "hypotheses": self.mixture.as_json(),
            "strain": self.nuisance.cost,
            "strained": self.nuisance.is_excessive,
            "sighted": self.sighted,
            "beyond_m": self.beyond_contacts,
        }


@dataclass(frozen=True, eq=False, kw_only=True)
class SmoothSurface(FittedShape):
    """A smooth surface through the contacts."""

    rejected: FamilyFit | None = None
    """the fit of the family that this surface is preferred to; the next search begins at its hypotheses."""

    def details(self) -> dict[str, object]:
        """Return JSON values of the result besides the surface."""
        left = {} if self.rejected is None else {"hypotheses_left": self.rejected.mixture.as_json()}
        return {**super().details(), **left}


def folds_of(contacts: int) -> list[list[int]]:
    """Divide contacts into at most ``FOLDS`` parts of about equal size, spread over their order."""
    return [list(range(k, contacts, FOLDS)) for k in range(min(FOLDS, contacts))]
