"""Estimators of shape by their names: levels of the dial ``shape.method``."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial

from experiments.shape_reconstruction.estimators.ellipsoid import by_ellipsoid
from experiments.shape_reconstruction.estimators.hermite import by_hermite
from experiments.shape_reconstruction.estimators.plain_bodies import by_box, by_hull, by_visual_hull
from experiments.shape_reconstruction.estimators.point_answer import PointEstimate, by_raw_points
from experiments.shape_reconstruction.estimators.stated_space import require_stated_size, require_stated_space
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.family.settings import LEVELS, FamilySettings
from experiments.shape_reconstruction.fusion.reconstruct import reconstruct, reconstruct_with_prior
from experiments.shape_reconstruction.pcn.completed_surface import by_completed_surface
from experiments.shape_reconstruction.pcn.glance import by_glance
from experiments.shape_reconstruction.pcn.glanced_surface import by_glanced_surface
from experiments.shape_reconstruction.pcn.network import by_completion
from experiments.shape_reconstruction.retrieval.known_shapes import by_known_shapes
from experiments.shape_reconstruction.surface import ShapeEstimate
from harness.basics.errors import FitRefused, OutOfDomain

METHODS: Mapping[str, Callable[[ShapeEvidence], ShapeEstimate]] = {
    "box": by_box,
    "ellipsoid": by_ellipsoid,
    "hull": by_hull,
    "visual-hull": by_visual_hull,
    "glance": by_glanced_surface,
    "rbf": by_hermite,
    "pcn": by_completed_surface,
    "family-coarse": partial(reconstruct_with_prior, settings=LEVELS["coarse"]),
    "retrieval": by_known_shapes,
    "family": reconstruct_with_prior,
    "family-fine": partial(reconstruct_with_prior, settings=LEVELS["fine"]),
}
"""From cheap to dear: a box takes 10 ms, the family some seconds."""

POINTS: Mapping[str, Callable[[ShapeEvidence], PointEstimate]] = {
    "raw points": by_raw_points,
    "glance": by_glance,
    "pcn": by_completion,
}
"""Those that answer in points, as a table scores them; of these, the networks have a surface too."""

QUICK, BEST = "rbf", "family"
"""While the arm waits for the next press; by default."""


def estimated(method: str, evidence: ShapeEvidence) -> ShapeEstimate:
    """The shape by a method.

    Args:
        method: a key of ``METHODS``.
        evidence: of a run.

    Raises:
        WrongUse: the folder of known shapes is not there, or holds none.
        FitRefused: the readings say too little for it, contradict each other, or contradict the size and the
            place that the scene states.
    """
    if evidence.look is None and not evidence.contacts:
        raise FitRefused(
            f"the object was not seen, and {len(evidence.touches)} ways of the gel met nothing; check where "
            "it stands and where the camera looks, or press again"
        )
    require_stated_space(evidence)
    with _refusing():
        found = METHODS[method](evidence)
    require_stated_size(found.mesh, evidence, method)
    return found


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
    require_stated_space(evidence)
    with _refusing():
        found = reconstruct(evidence, settings, previous)
    require_stated_size(found.mesh, evidence, "family")
    return found


def pointed(method: str, evidence: ShapeEvidence) -> PointEstimate:
    """Places of the shape's surface by a method, a key of ``POINTS``.

    Raises:
        FitRefused: the readings say too little for it.
    """
    with _refusing():
        return POINTS[method](evidence)


@contextmanager
def _refusing() -> Iterator[None]:
    """Readings outside of what a method is made for are a refusal of its answer."""
    try:
        yield
    except OutOfDomain as error:
        raise FitRefused(str(error)) from error
