"""A glance where nothing was touched, or too little to be surer; else what contacts and picture say."""

from dataclasses import replace

from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.family.settings import FamilySettings
from experiments.shape_reconstruction.family_or_smooth import ENOUGH, by_family
from experiments.shape_reconstruction.pcn.glanced_surface import by_glanced_surface
from experiments.shape_reconstruction.surface import ShapeEstimate
from harness.basics.errors import FitRefused

SPREAD = 0.3
"""Share of what household shapes state that is held against a glance: they state all that few contacts allow,
and the likeliest is nearer. Found on 88 answers by one to five contacts, of 18 development runs."""


def by_glance_or_family(evidence: ShapeEvidence, settings: FamilySettings | None = None) -> ShapeEstimate:
    """The shape by all that is known: many household shapes fit one outline, and few of them are likely.

    Which are is learnt; so without a contact the network answers, and the family where the network may not.
    Beside a few contacts, which still fit shapes of many depths, the glance does where it is surer by far.

    Args:
        evidence: one contact or a silhouette at least.
        settings: how much of the family is searched.

    Raises:
        OutOfDomain: nothing was touched or seen.
    """
    glanced = _glanced(evidence)
    if glanced is not None and not evidence.contacts:
        return glanced
    found = by_family(evidence, settings)
    if glanced is None or SPREAD * found.deviation.mean() <= glanced.deviation.mean():
        return found
    said = f"household shapes by {len(evidence.contacts)} contacts are less sure: they do not count"
    return replace(
        glanced,
        doubtful=found.doubtful,
        flags=(*glanced.flags, said),
        seconds=glanced.seconds + found.seconds,
    )


def _glanced(evidence: ShapeEvidence) -> ShapeEstimate | None:
    """By the picture alone; None where so many contacts say more, or the network may not answer."""
    if not evidence.sighted or len(evidence.contacts) >= ENOUGH:
        return None
    try:
        return by_glanced_surface(evidence)
    except FitRefused:
        return None  # of the family's shapes one may still have this outline
