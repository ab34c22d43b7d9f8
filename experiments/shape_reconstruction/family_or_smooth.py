"""A household shape where one fits the readings, else the smooth surface through the contacts."""

from dataclasses import replace

from experiments.shape_reconstruction.estimators.hermite import by_hermite
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.family.estimate import family_estimate
from experiments.shape_reconstruction.family.settings import FamilySettings
from experiments.shape_reconstruction.surface import ShapeEstimate

ENOUGH = 6
"""Contacts from which on a smooth surface says more than a household shape that does not fit them."""


MANY, BEYOND = 12, 10.0e-3
"""Contacts without a picture, and m beyond them that a household shape lies in the mean, from which on it is
not believed: so many presses would have met it there."""


def by_family(evidence: ShapeEvidence, settings: FamilySettings | None = None) -> ShapeEstimate:
    """The family's estimate; of an object outside of it, the smooth surface, which says so.

    Args:
        evidence: one contact or a silhouette at least.
        settings: how much is searched.

    Raises:
        OutOfDomain: nothing was touched or seen.
    """
    found = family_estimate(evidence, settings)
    why = _why_smooth(found, evidence)
    if why is None:
        return found
    smooth = by_hermite(evidence, symmetric=False)  # every class of round bodies was tried
    open_ = {*found.not_bounded, *smooth.not_bounded}
    return replace(
        smooth,
        not_bounded=tuple(axis for axis in "xyz" if axis in open_),
        flags=(*found.flags, f"{why}: the surface is by rbf"),
        doubtful=found.doubtful,
        seconds=found.seconds + smooth.seconds,
    )


def _why_smooth(found: ShapeEstimate, evidence: ShapeEvidence) -> str | None:
    count, beyond = len(evidence.contacts), found.details["beyond_m"]
    assert isinstance(beyond, float)
    if found.details["foreign"] and count >= ENOUGH:
        return f"no household shape fits {count} contacts"
    if not evidence.sighted and beyond > BEYOND and count >= MANY:
        return f"the household shape lies {beyond * 1e3:.0f} mm beyond {count} contacts in the mean"
    return None
