"""Estimators of shape by their names: levels of the dial ``shape.method``."""

from collections.abc import Callable, Mapping
from functools import partial

from experiments.shape_reconstruction.estimators.hermite import by_hermite
from experiments.shape_reconstruction.estimators.plain_bodies import by_box, by_hull, by_visual_hull
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.family.estimate import family_estimate
from experiments.shape_reconstruction.family.settings import LEVELS
from experiments.shape_reconstruction.surface import ShapeEstimate
from harness.basics.errors import FitRefused, OutOfDomain

METHODS: Mapping[str, Callable[[ShapeEvidence], ShapeEstimate]] = {
    "box": by_box,
    "hull": by_hull,
    "visual-hull": by_visual_hull,
    "rbf": by_hermite,
    "family-coarse": partial(family_estimate, settings=LEVELS["coarse"]),
    "family": family_estimate,
    "family-fine": partial(family_estimate, settings=LEVELS["fine"]),
}
"""From cheap to dear."""

QUICK, INFORMATIVE, BEST = "rbf", "family-coarse", "family"
"""While the arm waits for the next press; where that goes by which shapes are likely; by default."""

TABLED: Mapping[str, tuple[str, ...]] = {
    "box": ("T",),
    "hull": ("T",),
    "visual-hull": ("V", "TV"),
    "rbf": ("T", "TV"),
    "family": ("T", "V", "TV"),
}
"""Methods in the table of shapes, from touch alone, the picture alone, and both."""


def estimated(method: str, evidence: ShapeEvidence) -> ShapeEstimate:
    """The shape by a method.

    Args:
        method: a key of ``METHODS``.
        evidence: of a run.

    Raises:
        FitRefused: the readings say too little for it, or contradict each other.
    """
    if evidence.look is None and not evidence.contacts:
        raise FitRefused(
            f"the object was not seen, and {len(evidence.touches)} ways of the gel met nothing; check where "
            "it stands and where the camera looks, or press again"
        )
    try:
        return METHODS[method](evidence)
    except OutOfDomain as error:
        raise FitRefused(str(error)) from error
