"""Estimators of shape by their names: levels of the knob ``shape.method``."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import cache, partial

import numpy as np

from experiments.shape_reconstruction.evidence import GuardedTouch, SeenMask, ShapeEvidence
from experiments.shape_reconstruction.family.search import CONTINUED, LEVELS, FamilySettings
from experiments.shape_reconstruction.fits import ShapeEstimate
from experiments.shape_reconstruction.prior.network import predict_surface
from experiments.shape_reconstruction.reconstruct import reconstruct, reconstruct_with_prior
from experiments.shape_reconstruction.smooth.hermite import fit_rbf
from experiments.shape_reconstruction.smooth.stated_space import require_stated_size, require_stated_space
from harness.basics.arrays import read_only
from harness.basics.errors import FitRefused, OutOfDomain
from harness.basics.geometry import frame_facing, transform
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


SMALLEST = replace(
    CONTINUED, draws=60, starts=4, refined=2, hops=1, hopping=1, finals=2, finishing=1, refining=1
)
"""Settings that run every kernel of the family and find nothing."""


@cache
def load_kernels(method: str) -> None:
    """Compile or load the kernels of a method, so that the seconds of no answer count it.

    A synthetic ball is reconstructed from its silhouette and presses on eight sides.

    Args:
        method: key of ``METHODS``.
    """
    radius, centre = 0.04, np.array([0.0, 0.0, 0.04])
    rows, columns = np.indices((60, 80))
    mask = np.hypot(rows - 29.5, columns - 39.5) < 10.0
    forward, right = np.array([-0.8, 0.0, -0.6]), np.array([0.0, 1.0, 0.0])
    axes = np.column_stack([right, np.cross(forward, right), forward])
    camera = transform(axes, centre - 0.8 * forward)
    look = SeenMask(mask, np.zeros_like(mask), camera, 200.0, 1e-3, 1e-3, 1e-3)
    touches = []
    for index, turn in enumerate(np.arange(8) * np.pi / 4.0):
        normal = np.array([np.cos(turn), np.sin(turn), 1.0]) / np.sqrt(2.0)
        frame = frame_facing(-normal, 0.0)
        offsets = np.array([[x, y, 0.0] for x in (-3e-3, 0.0, 3e-3) for y in (-3e-3, 0.0, 3e-3)]) @ frame.T
        normals = radius * normal + offsets
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        points, pose = centre + radius * normals, transform(frame, centre + radius * normal)
        arrays = read_only(points), read_only(normals)  # as those of a recorded press: of another type
        touches.append(GuardedTouch(read_only(pose), 0.03, *arrays, 0.5e-3, 0.05, index))
    evidence = ShapeEvidence(tuple(touches), look, (0.034, 0.03), 2.5e-3, 0.12, 0.02, 1e-3, 0.3)
    small = {name: partial(reconstruct_with_prior, settings=SMALLEST) for name in METHODS if "family" in name}
    for some in (evidence, replace(evidence, touches=evidence.touches[:1])):
        with suppress(FitRefused, OutOfDomain):
            small.get(method, METHODS[method])(some)


def _within_stated_space(method: Method, evidence: ShapeEvidence, name: str) -> ShapeEstimate:
    """Reconstruct the shape; refuse readings and answers that contradict the stated place and size."""
    require_stated_space(evidence)
    try:
        found = method(evidence)
    except OutOfDomain as error:
        raise FitRefused(str(error)) from error
    require_stated_size(found.mesh, evidence, name)
    return found
