"""The one picture of an object, if it shows the object."""

from experiments.shape_reconstruction.estimators.free_space import Silhouette
from experiments.shape_reconstruction.evidence import ShapeEvidence
from harness.basics.arrays import FloatArray

LEAST = 12
"""Pixels that an object must cover to be seen."""


def silhouette_of(evidence: ShapeEvidence, contacts: FloatArray) -> Silhouette | None:
    """The silhouette, shifted so that ``(n, 3)`` m of contacts are within it; None where nothing was seen."""
    look = evidence.look
    if look is None or int(look.mask.sum()) < LEAST or bool(look.mask.all()):
        return None
    return Silhouette.of(look, contacts)
