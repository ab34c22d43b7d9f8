"""Estimators of shape by their names: levels of the knob ``shape.method``."""

from collections.abc import Callable, Mapping
from functools import partial

from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.family.settings import LEVELS, FamilySettings
from experiments.shape_reconstruction.prior.surface import predict_surface
from experiments.shape_reconstruction.reconstruct import reconstruct, reconstruct_with_prior
from experiments.shape_reconstruction.smooth.hermite import fit_rbf
from experiments.shape_reconstruction.smooth.stated_space import require_stated_size, require_stated_space
from experiments.shape_reconstruction.surface import ShapeEstimate
from harness.basics.errors import FitRefused, OutOfDomain
from harness.effects.accuracy import Knob, Level
from harness.effects.catalogue import EFFECTS
from harness.effects.effect import knobs_of

Method = Callable[[ShapeEvidence], ShapeEstimate]

METHODS: Mapping[str, Method] = {
    "glance": predict_surface,
    "rbf": fit_rbf,
    "family-coarse": partial(reconstruct_with_prior, settings=LEVELS["coarse"]),
    "family": reconstruct_with_prior,
    "family-fine": partial(reconstruct_with_prior, settings=LEVELS["fine"]),
}
"""From cheap to expensive: the first takes 0.2 s, the last half a minute."""

REMOVED: Mapping[Level, str] = {
    "box": "rbf",
    "ellipsoid": "rbf",
    "hull": "rbf",
    "visual-hull": "glance",
    "pcn": "family",
    "retrieval": "family",
}
"""Methods of earlier versions, each with the one that replaces it."""

QUICK, BEST = "rbf", "family"
"""The method between two presses, and the default."""

METHOD = Knob("shape.method", tuple(METHODS), "", "method", BEST, "estimator of the surface", REMOVED)
OWN: tuple[Knob[Level], ...] = (METHOD,)
KNOBS: tuple[Knob[Level], ...] = (*OWN, *knobs_of(EFFECTS))
"""The knobs of a shape reconstruction: its estimator, and those of the simulation."""


def estimated(method: str, evidence: ShapeEvidence, methods: Mapping[str, Method] = METHODS) -> ShapeEstimate:
    """Reconstruct the shape by a method.

    Args:
        method: key of ``methods``.
        evidence: readings of a run.
        methods: estimators by name.

    Raises:
        FitRefused: the readings are too few for the method, contradict each other, or contradict the size
            and the place that the scene states.
    """
    if evidence.look is None and not evidence.contacts:
        raise FitRefused(
            f"the object was not seen, and {len(evidence.touches)} ways of the gel met nothing; check where "
            "it stands and where the camera looks, or press again"
        )
    return _within_stated_space(methods[method], evidence, method)


def continued(
    evidence: ShapeEvidence, settings: FamilySettings, previous: ShapeEstimate | None
) -> ShapeEstimate:
    """Reconstruct the shape between two presses, from the hypotheses before the last one.

    Args:
        evidence: of a run so far.
        settings: how much of the family is searched beside those hypotheses.
        previous: the estimate before the last press; None at the first.

    Raises:
        FitRefused: as ``estimated``.
    """
    return _within_stated_space(
        lambda readings: reconstruct(readings, settings, previous), evidence, "family"
    )


def _within_stated_space(method: Method, evidence: ShapeEvidence, name: str) -> ShapeEstimate:
    """Reconstruct the shape; refuse readings and answers that contradict the stated place and size."""
    require_stated_space(evidence)
    try:
        found = method(evidence)
    except OutOfDomain as error:
        raise FitRefused(str(error)) from error
    require_stated_size(found.mesh, evidence, name)
    return found
