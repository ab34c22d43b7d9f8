"""A household shape where one fits the readings, else the smooth surface through the contacts."""

from dataclasses import replace

from experiments.shape_reconstruction.estimators.hermite import by_hermite
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.family.estimate import family_estimate
from experiments.shape_reconstruction.family.settings import FamilySettings
from experiments.shape_reconstruction.surface import ShapeEstimate

ENOUGH = 6
"""Contacts from which on a smooth surface says more than a household shape that does not fit them."""


def by_family(evidence: ShapeEvidence, settings: FamilySettings | None = None) -> ShapeEstimate:
    """The family's estimate; of an object outside of it, the smooth surface, which says so.

    Args:
        evidence: one contact or a silhouette at least.
        settings: how much is searched.

    Raises:
        OutOfDomain: nothing was touched or seen.
    """
    found = family_estimate(evidence, settings)
    if not found.details["foreign"] or len(evidence.contacts) < ENOUGH:
        return found
    smooth = by_hermite(evidence, symmetric=False)  # every class of round bodies was tried
    fallen = f"no household shape fits {len(evidence.contacts)} contacts: the surface is by rbf"
    return replace(
        smooth,
        flags=(*found.flags, fallen),
        doubtful=found.doubtful,
        seconds=found.seconds + smooth.seconds,
    )
