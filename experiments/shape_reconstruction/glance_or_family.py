"""A glance where nothing was touched, else what the contacts and the picture say together."""

from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.family.settings import FamilySettings
from experiments.shape_reconstruction.family_or_smooth import by_family
from experiments.shape_reconstruction.pcn.glanced_surface import by_glanced_surface
from experiments.shape_reconstruction.surface import ShapeEstimate
from harness.basics.errors import FitRefused


def by_glance_or_family(evidence: ShapeEvidence, settings: FamilySettings | None = None) -> ShapeEstimate:
    """The shape by all that is known: many household shapes fit one outline, and few of them are likely.

    Which are is learnt; so without a contact the network answers, and the family where the network may not.

    Args:
        evidence: one contact or a silhouette at least.
        settings: how much of the family is searched.

    Raises:
        OutOfDomain: nothing was touched or seen.
    """
    if not evidence.contacts and evidence.sighted:
        try:
            return by_glanced_surface(evidence)
        except FitRefused:
            pass  # of the family's shapes one may still have this outline
    return by_family(evidence, settings)
