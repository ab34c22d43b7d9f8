"""Choose between the shape family, the smooth surface and the single-view prior: all acceptance rules.

Each candidate predicts the contacts that were left out of its fit, and the outline in the picture. The family
is assumed until enough contacts at different places agree with it.
"""

from dataclasses import replace

import numpy as np

from experiments.shape_reconstruction import thresholds as limits
from experiments.shape_reconstruction.fits import FamilyFit, SmoothSurface
from experiments.shape_reconstruction.surface import TOUCHED, ShapeEstimate
from harness.basics.arrays import FloatArray
from harness.basics.errors import FitRefused


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
    reason = rejection_reason(fit, smooth)
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


def rejection_reason(fit: FamilyFit, smooth: SmoothSurface | None) -> str | None:
    """State why the family is not the answer; None where it is.

    Args:
        fit: the shape family.
        smooth: the smooth surface; None without a contact.
    """
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


def needs_search(best: FamilyFit, made: int) -> bool:
    """Decide whether one more search is made.

    More are made of what fits poorly, of several classes that fit alike, and without a picture.

    Args:
        best: the best fit so far.
        made: searches so far.
    """
    many = len(best.left_out) >= limits.MIN_CONTACTS
    least = 1 if best.sighted or not many else limits.MIN_BLIND_SEARCHES
    rivals = sum(weight >= limits.MIN_RIVAL_WEIGHT for weight in best.mixture.by_class().values())
    unsure = rivals > 1 if many else best.nuisance.cost > limits.MAX_NUISANCE_OF_FEW
    return made < limits.MAX_SEARCHES and (made < least or is_poor(best) or (made == least and unsure))
