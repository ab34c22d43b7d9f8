"""Reconstruct a shape from contacts, silhouette and the single-view prior."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
from scipy import ndimage

from experiments.shape_reconstruction.choice import (
    MAX_OUTLINE_ERROR,
    MIN_CONTACTS,
    Candidate,
    choose,
    folds_of,
    rejection_reason,
)
from experiments.shape_reconstruction.evidence import SeenMask, ShapeEvidence
from experiments.shape_reconstruction.family.classes import FamilyShape
from experiments.shape_reconstruction.family.contact_fit import contact_fit, displacement, moved_points
from experiments.shape_reconstruction.family.estimate import (
    LEFT,
    LOOSE,
    OUTSIDE,
    POINT_SIGMA,
    RIVAL,
    family_estimate,
    open_without_class,
)
from experiments.shape_reconstruction.family.freedom import STRAINED
from experiments.shape_reconstruction.family.observed import directions_of
from experiments.shape_reconstruction.family.search import FamilySearch
from experiments.shape_reconstruction.family.settings import ANEW, FamilySettings
from experiments.shape_reconstruction.prior.network import with_supposed
from experiments.shape_reconstruction.prior.surface import by_glanced_surface
from experiments.shape_reconstruction.smooth.bent_prior import bend_prior
from experiments.shape_reconstruction.smooth.free_space import shift_sigma
from experiments.shape_reconstruction.smooth.hermite import by_hermite
from experiments.shape_reconstruction.surface import ShapeEstimate
from harness.basics.arrays import FloatArray
from harness.basics.errors import FitRefused, OutOfDomain
from harness.basics.faces.ray_mesh import RayMesh
from harness.basics.mesh import Mesh

SEARCHES, BLIND_SEARCHES = 3, 2
"""Searches of a shape that no search fits well; of one without a picture, at least."""

UNEASY = 4.0
"""Nuisance-parameter cost of an answer by few contacts above which one more search is made."""


def reconstruct_with_prior(evidence: ShapeEvidence, settings: FamilySettings | None = None) -> ShapeEstimate:
    """Reconstruct the shape from contacts, silhouette and the single-view prior.

    Args:
        evidence: one contact or a silhouette at least.
        settings: how much of the family is searched; the default level where not given.

    Raises:
        FitRefused: no shape of the family is at the stated place, and there is no contact.
        OutOfDomain: nothing was touched or seen.
    """
    if not evidence.contacts:
        with suppress(FitRefused):  # the prior may not apply
            return by_glanced_surface(evidence)
    return reconstruct(evidence, settings)


def reconstruct(
    evidence: ShapeEvidence, settings: FamilySettings | None = None, previous: ShapeEstimate | None = None
) -> ShapeEstimate:
    """Reconstruct the shape by the family or the smooth surface; by the family where nothing was touched.

    Args:
        evidence: one contact or a silhouette at least.
        settings: how much of the family is searched; the default level where not given.
        previous: answer of this function from fewer readings of the same object; the search begins at its
            hypotheses too.

    Raises:
        FitRefused: no shape of the family is at the stated place, and there is no contact.
        OutOfDomain: nothing was touched or seen.
    """
    settings = settings or FamilySettings()
    evidence = evidence if len(evidence.contacts) >= MIN_CONTACTS else with_supposed(evidence)
    smooth = _smooth(evidence)
    try:
        fit = (
            _search(evidence, settings, smooth)
            if previous is None
            else _continue(evidence, settings, previous, smooth)
        )
    except FitRefused:
        if smooth is None:
            raise
        return choose(None, smooth, None)
    found = choose(fit, smooth, None)
    seconds = fit.estimate.seconds + (0.0 if smooth is None else smooth.estimate.seconds)
    if smooth is None or found.mesh is not smooth.estimate.mesh:
        return replace(found, seconds=seconds)
    details = {**found.details, LEFT: fit.estimate.details["hypotheses"]}
    return replace(found, seconds=seconds, details=details)


def _smooth(evidence: ShapeEvidence) -> Candidate | None:
    """The smooth surface that predicts left-out contacts best; None where there is none."""
    found: list[Candidate] = []
    if not evidence.contacts:
        return None
    if evidence.sighted:
        # The prior may not apply: its window is too small, or free space leaves nothing of it.
        with suppress(FitRefused, OutOfDomain):
            found.append(bend_prior(evidence))
    if not found or len(evidence.contacts) >= MIN_CONTACTS:
        with suppress(OutOfDomain):  # contacts and free space may contradict each other
            surface = by_hermite(evidence, symmetric=False)  # every class of round bodies is in the family
            found.append(Candidate(surface, np.array(surface.details["left_out_m"])))
    shown = [replace(one, outline_error=outline_error(one.estimate.mesh, evidence.look)) for one in found]
    best = min((one.outline_error for one in shown), default=0.0)
    alike = [one for one in shown if one.outline_error <= best + MAX_OUTLINE_ERROR]
    return min(alike, key=lambda one: one.misfit, default=None)


def _search(evidence: ShapeEvidence, settings: FamilySettings, smooth: Candidate | None) -> Candidate:
    """The family's best candidate of one to three searches, each by draws of its own.

    More searches are made of what fits poorly, of several classes that fit alike, and without a picture,
    where the cost has more local minima. Of good fits the least cost is taken, of poor ones the least contact
    residual.
    """
    best = _candidate(family_estimate(evidence, settings), evidence)
    seconds = best.estimate.seconds
    many = len(evidence.contacts) >= MIN_CONTACTS
    least = 1 if evidence.sighted or not many else BLIND_SEARCHES
    for more in range(1, SEARCHES):
        classes = best.estimate.details["classes"]
        assert isinstance(classes, Mapping)
        rivals = sum(weight >= RIVAL for weight in classes.values())
        unsure = rivals > 1 if many else _strain_of(best) > UNEASY
        again = _is_poor(best) or (more == least and unsure)
        if more >= least and not again:
            break
        found = _candidate(family_estimate(evidence, replace(settings, seed=settings.seed + more)), evidence)
        seconds += found.estimate.seconds
        best = min(best, found, key=_rank)
    return _with_predictions(best, evidence, smooth, seconds)


def _continue(
    evidence: ShapeEvidence, settings: FamilySettings, previous: ShapeEstimate, smooth: Candidate | None
) -> Candidate:
    """The family's candidate from another's hypotheses; of a poor fit by a new search beside them."""
    found = _candidate(family_estimate(evidence, settings, (previous,)), evidence)
    found = _with_predictions(found, evidence, smooth, found.estimate.seconds)
    if not _is_poor(found) and rejection_reason(found, smooth) is None:
        return found
    again = family_estimate(evidence, replace(ANEW, seed=settings.seed), (found.estimate,))
    seconds = found.estimate.seconds + again.seconds
    return _with_predictions(_candidate(again, evidence), evidence, smooth, seconds)


def _candidate(found: ShapeEstimate, evidence: ShapeEvidence) -> Candidate:
    """A family's estimate with its outline compared; left-out contacts are predicted for the best alone."""
    nothing = np.zeros(len(evidence.contacts))
    return Candidate(
        found, nothing, outline_error(found.mesh, evidence.look), open_without_class(evidence, found.mesh)
    )


def _with_predictions(
    found: Candidate, evidence: ShapeEvidence, smooth: Candidate | None, seconds: float
) -> Candidate:
    estimate = replace(found.estimate, seconds=seconds)
    if smooth is None or rejection_reason(found, None) is not None:
        return replace(found, estimate=estimate)
    return replace(found, estimate=estimate, left_out=predict_left_out(estimate, evidence))


def _is_poor(found: Candidate) -> bool:
    """True where the shape fits contacts or outline poorly, or only on a bench that is off."""
    typical = found.estimate.details["contact_cost"]
    assert isinstance(typical, float)
    return typical > LOOSE or _strain_of(found) > STRAINED or found.outline_error > MAX_OUTLINE_ERROR


def _strain_of(found: Candidate) -> float:
    strain = found.estimate.details["strain"]
    assert isinstance(strain, float)
    return strain


def _rank(found: Candidate) -> tuple[bool, float]:
    """Good fits go before poor ones, by their cost; poor ones by their contact residual."""
    poor = _is_poor(found)
    cost = found.estimate.details["contact_cost" if poor else "cost"]
    assert isinstance(cost, float)
    return poor, cost


HYPOTHESES, ROUNDS = 3, 10
"""Hypotheses that are fitted again without some contacts, and rounds of each fit."""

AROUND = 24
"""Pixels around the silhouette in which a surface is compared with it."""

_BORDER = 1.0
"""Pixels that a rendered border and a mask's differ by besides the camera's error."""


def predict_left_out(found: ShapeEstimate, evidence: ShapeEvidence) -> FloatArray:
    """Fit the family's hypotheses without each part of the contacts, and measure those that were left out.

    Args:
        found: by the family; its hypotheses are where each fit begins.
        evidence: that it was found from.

    Returns:
        ``(contacts,)`` rms distance of each from the surface fitted and bent to the others, m.
    """
    contacts = evidence.contacts
    stated: Sequence[Mapping[str, Any]] = found.details["hypotheses"]  # type: ignore[assignment]
    errors = np.zeros(len(contacts))
    for fold in folds_of(len(contacts)):
        kept = evidence.without(fold)
        search = FamilySearch(kept, FamilySettings())
        fits = []
        for one in stated[:HYPOTHESES]:
            code, numbers = np.array(one["code"], np.int64), np.array(one["numbers"], np.float64)
            begun = FamilyShape(str(one["class"]), code, numbers)
            hypothesis = search.seeded(begun, np.array(one["drawn_about"]))
            fits.append(search.refined(hypothesis, ROUNDS, last=True))
        shape = min(fits, key=lambda one: one.cost).shape
        bent_to = moved_points(shape, kept, np.ones(len(kept.contacts), bool))
        typical = contact_fit(shape, search.full).typical
        far = float(np.sqrt(np.mean(np.sum(bent_to[1] ** 2, axis=1)))) if typical > OUTSIDE else 0.0
        for k in fold:
            which = np.array([one is contacts[k] for one in contacts])
            points, offsets = moved_points(shape, evidence, which)
            sigma = np.full(len(bent_to[0]), POINT_SIGMA)
            moved = displacement(bent_to[0] - bent_to[1], bent_to[1], sigma, points - offsets, far)
            errors[k] = float(np.sqrt(np.mean(np.sum((offsets - moved) ** 2, axis=1))))
    return errors


def outline_error(mesh: Mesh, look: SeenMask | None) -> float:
    """Measure the share of the silhouette that a surface misses or adds beyond the camera's error.

    Args:
        mesh: closed surface, m in ``stand``.
        look: the silhouette; None without a picture.

    Returns:
        Pixels missed and added over the silhouette's; zero without a silhouette.
    """
    if look is None or not look.mask.any():
        return 0.0
    rows, columns = np.nonzero(ndimage.binary_dilation(look.mask, iterations=AROUND))
    window = slice(rows.min(), rows.max() + 1), slice(columns.min(), columns.max() + 1)
    mask, known = look.mask[window], ~look.hidden[window]
    row, column = np.indices(mask.shape)
    pixels = np.column_stack([column.ravel() + window[1].start + 0.5, row.ravel() + window[0].start + 0.5])
    hits = RayMesh(mesh).first_hits(look.stand_from_camera[:3, 3], directions_of(look, pixels))
    shown = np.isfinite(hits.distance).reshape(mask.shape)
    if not shown.any():
        return 1.0
    depth = float(np.median(hits.distance[np.isfinite(hits.distance)]))
    near = _BORDER + shift_sigma(look, depth)
    added = shown & known & (ndimage.distance_transform_edt(~mask) > near)
    missed = mask & known & (ndimage.distance_transform_edt(~shown) > near)
    return float((added.sum() + missed.sum()) / mask.sum())
