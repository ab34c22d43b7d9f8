"""A glance until something is touched; then household shapes that contacts, picture and glance allow."""

from dataclasses import replace

from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.family.settings import FamilySettings
from experiments.shape_reconstruction.family_or_smooth import ENOUGH, by_family
from experiments.shape_reconstruction.pcn.glance import shipped, with_supposed
from experiments.shape_reconstruction.pcn.glanced_surface import by_glanced_surface
from experiments.shape_reconstruction.surface import ShapeEstimate
from harness.basics.faces.nearest_surface import NearestSurface

ALOOF = 3.0
"""Of what a glance is off on shapes held out, the mean distance of its points from a household shape by few
contacts above which that is not believed. On 32 answers by one or two contacts of 16 development runs a
glance was 6.3 mm off in the mean and 10.6 at most, the household shape 4.2, and once 24."""


def by_glance_or_family(evidence: ShapeEvidence, settings: FamilySettings | None = None) -> ShapeEstimate:
    """The shape by all that is known: many household shapes fit one outline, and few of them are likely.

    Which are is learnt; so without a contact the network answers, and the family where the network may not.
    From the first contact on the family does, which is held against what the network supposes; but not where
    it is nowhere near that.

    Args:
        evidence: one contact or a silhouette at least.
        settings: how much of the family is searched.

    Raises:
        OutOfDomain: nothing was touched or seen.
    """
    few = len(evidence.contacts) < ENOUGH
    evidence = with_supposed(evidence) if few else evidence
    if not few or not len(evidence.supposed):
        return by_family(evidence, settings)  # of its shapes one may still have this outline
    if not evidence.contacts:
        return by_glanced_surface(evidence)
    found = by_family(evidence, settings)
    if NearestSurface(found.mesh).distances(evidence.supposed).mean() <= ALOOF * shipped().held_out:
        return found
    glanced, count = by_glanced_surface(evidence), len(evidence.contacts)
    said = f"the household shape by {count} contacts is nowhere near a glance: it does not count"
    return replace(
        glanced,
        doubtful=found.doubtful,
        flags=(*glanced.flags, said),
        seconds=glanced.seconds + found.seconds,
    )
