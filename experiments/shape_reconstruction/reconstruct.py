"""Reconstruct a shape from contacts, silhouette and the single-view prior.

Each candidate predicts the contacts that were left out of its fit, and the outline in the image. The family
is assumed until enough contacts at different places agree with it.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np
from scipy import ndimage

from experiments.shape_reconstruction import thresholds as limits
from experiments.shape_reconstruction.evidence import SeenMask, ShapeEvidence
from experiments.shape_reconstruction.family.contact_fit import contact_fit, displacement, moved_points
from experiments.shape_reconstruction.family.estimate import POINT_SIGMA, fit_family, open_without_class
from experiments.shape_reconstruction.family.observed import directions_of
from experiments.shape_reconstruction.family.search import LEVELS, FamilySearch, FamilySettings, Hypothesis
from experiments.shape_reconstruction.fits import TOUCHED, FamilyFit, ShapeEstimate, SmoothSurface, folds_of
from experiments.shape_reconstruction.prior.network import predict_surface, with_prior_points
from experiments.shape_reconstruction.smooth.bent_prior import bend_prior
from experiments.shape_reconstruction.smooth.free_space import shift_sigma
from experiments.shape_reconstruction.smooth.hermite import fit_rbf
from harness.basics.arrays import FloatArray
from harness.basics.errors import FitRefused, OutOfDomain
from harness.basics.faces.ray_mesh import RayMesh
from harness.basics.mesh import Mesh


def reconstruct_with_prior(evidence: ShapeEvidence, settings: FamilySettings | None = None) -> ShapeEstimate:
    """Reconstruct the shape from contacts, silhouette and the single-view prior.

    Args:
        evidence: one contact or a silhouette at least.
        settings: amount of search; the default level where not given.

    Raises:
        FitRefused: no shape of the family is at the stated place, and there is no contact.
        OutOfDomain: nothing was touched or seen.
    """
    if not evidence.contacts:
        with suppress(FitRefused):  # the prior may not apply
            return choose(None, None, predict_surface(evidence))
    return reconstruct(evidence, settings)


def reconstruct(
    evidence: ShapeEvidence, settings: FamilySettings | None = None, previous: ShapeEstimate | None = None
) -> ShapeEstimate:
    """Reconstruct the shape by the family or the smooth surface; by the family where nothing was touched.

    Args:
        evidence: one contact or a silhouette at least.
        settings: amount of search; the default level where not given.
        previous: answer of this function from fewer readings of the same object; the search begins at its
            hypotheses too.

    Raises:
        FitRefused: no shape of the family is at the stated place, and there is no contact.
        OutOfDomain: nothing was touched or seen.
    """
    settings = settings or FamilySettings()
    evidence = evidence if len(evidence.contacts) >= limits.MIN_CONTACTS else with_prior_points(evidence)
    smooth = _smooth(evidence)
    try:
        fit = (
            _search(evidence, settings, smooth)
            if previous is None
            else _continue(evidence, settings, _hypotheses_of(previous), smooth)
        )
    except FitRefused:
        if smooth is None:
            raise
        return choose(None, smooth, None)
    found = choose(fit, smooth, None)
    if isinstance(found, SmoothSurface):
        found = replace(found, rejected=fit)
    return replace(found, seconds=fit.seconds + (0.0 if smooth is None else smooth.seconds))


def _hypotheses_of(previous: ShapeEstimate) -> tuple[Hypothesis, ...]:
    fit = previous.rejected if isinstance(previous, SmoothSurface) else previous
    return fit.mixture.hypotheses if isinstance(fit, FamilyFit) else ()


def _smooth(evidence: ShapeEvidence) -> SmoothSurface | None:
    """Fit the smooth surface that predicts left-out contacts best; None where there is none."""
    found: list[SmoothSurface] = []
    if not evidence.contacts:
        return None
    if evidence.sighted:
        # The prior may not apply: its window is too small, or free space leaves nothing of it.
        with suppress(FitRefused, OutOfDomain):
            found.append(bend_prior(evidence))
    if not found or len(evidence.contacts) >= limits.MIN_CONTACTS:
        with suppress(OutOfDomain):  # contacts and free space may contradict each other
            found.append(fit_rbf(evidence, symmetric=False))  # the family has all classes of round bodies
    shown = [replace(one, outline_error=outline_error(one.mesh, evidence.look)) for one in found]
    best = min((one.outline_error for one in shown), default=0.0)
    alike = [one for one in shown if one.outline_error <= best + limits.MAX_OUTLINE_ERROR]
    return min(alike, key=lambda one: one.misfit, default=None)


def _search(evidence: ShapeEvidence, settings: FamilySettings, smooth: SmoothSurface | None) -> FamilyFit:
    """Fit the family by one to three searches, each with its own draws, and return the best fit."""
    best = _fit(evidence, settings)
    seconds, made = best.seconds, 1
    while _needs_search(best, made):
        found = _fit(evidence, replace(settings, seed=settings.seed + made))
        seconds, made = seconds + found.seconds, made + 1
        best = min(best, found, key=rank)
    return _with_predictions(best, evidence, smooth, seconds)


def _continue(
    evidence: ShapeEvidence,
    settings: FamilySettings,
    seeds: Sequence[Hypothesis],
    smooth: SmoothSurface | None,
) -> FamilyFit:
    """Fit the family from earlier hypotheses; repeat a poor fit by a new search next to its hypotheses."""
    found = _fit(evidence, settings, seeds)
    found = _with_predictions(found, evidence, smooth, found.seconds)
    if not is_poor(found) and _rejection_reason(found, smooth) is None:
        return found
    again = _fit(evidence, replace(LEVELS["coarse"], seed=settings.seed), found.mixture.hypotheses)
    return _with_predictions(again, evidence, smooth, found.seconds + again.seconds)


def _fit(evidence: ShapeEvidence, settings: FamilySettings, seeds: Sequence[Hypothesis] = ()) -> FamilyFit:
    fit = fit_family(evidence, settings, seeds)
    error, free = outline_error(fit.mesh, evidence.look), open_without_class(evidence, fit.mesh)
    return replace(fit, outline_error=error, open_axes=free)


def _with_predictions(
    fit: FamilyFit, evidence: ShapeEvidence, smooth: SmoothSurface | None, seconds: float
) -> FamilyFit:
    """Predict left-out contacts where the smooth surface competes with a fit that is not yet rejected."""
    fit = replace(fit, seconds=seconds)
    if smooth is None or _rejection_reason(fit, None) is not None:
        return fit
    return replace(fit, left_out=predict_left_out(fit, evidence))


HYPOTHESES, ROUNDS = 3, 10
"""Hypotheses that are fitted again without some contacts, and rounds of each fit."""

AROUND = 24
"""Margin around the silhouette in which a surface is compared with it, pixels."""

_BORDER = 1.0
"""Distance between a rendered border and a mask's besides the camera's error, pixels."""


def predict_left_out(fit: FamilyFit, evidence: ShapeEvidence) -> FloatArray:
    """Fit the family's hypotheses without each part of the contacts, and measure those that were left out.

    Args:
        fit: of the family; its hypotheses are where each fit begins.
        evidence: readings that it was fitted to.

    Returns:
        ``(contacts,)`` rms distance of each from the surface fitted and bent to the others, m.
    """
    contacts = evidence.contacts
    errors = np.zeros(len(contacts))
    for fold in folds_of(len(contacts)):
        kept = evidence.without(fold)
        search = FamilySearch(kept, FamilySettings())
        begun = [search.start(one.shape, one.prior.middle) for one in fit.mixture.hypotheses[:HYPOTHESES]]
        fits = [search.refine(one, ROUNDS, last=True) for one in begun]
        shape = min(fits, key=lambda one: one.cost).shape
        bent_to = moved_points(shape, kept, np.ones(len(kept.contacts), bool))
        is_outside = contact_fit(shape, search.full).typical > limits.OUTSIDE_CONTACT_COST
        far = float(np.sqrt(np.mean(np.sum(bent_to[1] ** 2, axis=1)))) if is_outside else 0.0
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


def choose(fit: FamilyFit | None, smooth: SmoothSurface | None, prior: ShapeEstimate | None) -> ShapeEstimate:
    """Choose the answer, and state what it rests on.

    Without a contact the answer is the prior, or the family where the prior does not apply. From the first
    contact on the family and the smooth surface compete; both pass through the contacts.

    Args:
        fit: the shape family; None where no shape of it is at the stated place.
        smooth: the smooth surface through the contacts; None without a contact.
        prior: the single-view prior; None without a usable picture.
    """
    touched = any(one is not None and len(one.left_out) for one in (fit, smooth))
    if not touched and prior is not None:
        return prior
    if fit is None:
        if smooth is None:
            raise FitRefused("nothing was touched, and no household shape fits the picture")
        return _as_smooth(smooth, (), "no household shape at the stated place fits the readings")
    reason = _rejection_reason(fit, smooth)
    if reason is not None and smooth is not None:
        return _as_smooth(smooth, fit.flags, reason)
    count = len(fit.left_out)
    if count >= limits.MIN_CONTACTS and reason is None:
        return replace(fit, deviation=_at_least(fit, fit.prediction_error))
    few = {0: "the picture alone", 1: "1 contact"}.get(count, f"{count} contacts")
    verb = "is" if count < 2 else "are"
    untested = f"{limits.MIN_CONTACTS} contacts are needed to test this, and there {verb} {few}"
    return replace(
        fit,
        deviation=np.hypot(fit.deviation, np.where(fit.known_by == TOUCHED, 0.0, limits.ASSUMED_DEVIATION)),
        not_bounded=tuple(axis for axis in "xyz" if axis in {*fit.not_bounded, *fit.open_axes}),
        flags=(*fit.flags, reason or f"assuming a household shape: {untested}"),
    )


def _rejection_reason(fit: FamilyFit, smooth: SmoothSurface | None) -> str | None:
    """State why the shape family is rejected; None if it is not."""
    count = len(fit.left_out)
    if fit.nuisance.is_excessive:
        return "no household shape fits the readings on a bench as this is calibrated"
    if fit.outline_error > limits.MAX_OUTLINE_ERROR:
        return (
            f"the best household shape misses or adds {100.0 * fit.outline_error:.0f} % of the outline in "
            f"the picture, and at most {100.0 * limits.MAX_OUTLINE_ERROR:.0f} % are the camera's error"
        )
    if (
        not fit.sighted
        and fit.beyond_contacts > limits.MAX_BEYOND_CONTACTS
        and count >= limits.MIN_BLIND_CONTACTS
    ):
        return (
            f"the household shape lies {fit.beyond_contacts * 1e3:.0f} mm beyond {count} contacts on average"
        )
    if smooth is not None and fit.misfit > smooth.misfit + limits.MIN_LOG_ODDS:
        return (
            f"contacts left out are {fit.prediction_error * 1e3:.1f} mm off the household shape and "
            f"{smooth.prediction_error * 1e3:.1f} mm off the smooth surface"
        )
    return None


def _as_smooth(smooth: SmoothSurface, flags: tuple[str, ...], reason: str) -> SmoothSurface:
    answer = f"the answer is the smooth surface through all contacts ({smooth.estimator})"
    return replace(
        smooth,
        deviation=_at_least(smooth, smooth.prediction_error),
        flags=(*flags, *smooth.flags, f"{reason}: {answer}"),
    )


def _at_least(found: ShapeEstimate, error: float) -> FloatArray:
    """``(vertices,)`` m: no part that was not touched is surer than predictions of left-out contacts are."""
    floor = np.where(found.known_by == TOUCHED, 0.0, error)
    return np.asarray(np.maximum(found.deviation, floor))


def is_poor(fit: FamilyFit) -> bool:
    """True where the shape fits contacts or outline poorly, or needs excessive bench errors."""
    poor_contacts = fit.contact_cost > limits.POOR_CONTACT_COST
    return poor_contacts or fit.nuisance.is_excessive or fit.outline_error > limits.MAX_OUTLINE_ERROR


def rank(fit: FamilyFit) -> tuple[bool, float]:
    """Rank fits: good ones by their cost, then poor ones by their contact residual."""
    poor = is_poor(fit)
    return poor, fit.contact_cost if poor else fit.mixture.best.cost


def _needs_search(best: FamilyFit, made: int) -> bool:
    """Decide on one more search: for a poor fit, several classes of similar fit, or no image."""
    many = len(best.left_out) >= limits.MIN_CONTACTS
    least = 1 if best.sighted or not many else limits.MIN_BLIND_SEARCHES
    rivals = sum(weight >= limits.MIN_RIVAL_WEIGHT for weight in best.mixture.by_class().values())
    unsure = rivals > 1 if many else best.nuisance.cost > limits.MAX_NUISANCE_OF_FEW
    return made < limits.MAX_SEARCHES and (made < least or is_poor(best) or (made == least and unsure))
