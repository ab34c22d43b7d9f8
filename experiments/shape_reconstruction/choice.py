"""Choose between the shape family, the smooth surface and the single-view prior: all acceptance rules.

Each candidate predicts the contacts that were left out of its fit, and the outline in the picture. The family
is assumed until enough contacts at different places agree with it.
"""

from dataclasses import dataclass, replace

import numpy as np

from experiments.shape_reconstruction.surface import TOUCHED, ShapeEstimate
from harness.basics.arrays import FloatArray

MIN_CONTACTS = 6
"""Contacts at different places that test whether an object is of the family."""

FAMILY_ODDS = 2.0
"""Log-likelihood by which the smooth surface must predict left-out contacts better: most objects are
household shapes, and few contacts are a noisy test."""

PREDICTION_SCALE = 2.0e-3
"""Scale of the Cauchy density of a left-out contact's distance, m: a slipped contact counts little."""

MAX_OUTLINE_ERROR = 0.05
"""Share of the silhouette that a shape may miss or add beyond the camera's error. Of 24 development runs
right answers have up to 0.01 and wrong ones 0.3 and more."""

BLIND_CONTACTS, MAX_BEYOND = 12, 10.0e-3
"""Contacts without a picture from which on a shape that lies farther beyond them on average, m, is rejected:
so many presses would have met it there."""

ASSUMED_DEVIATION = 5.1e-3
"""Standard deviation of a surface that rests on the assumption of the family alone, m: that of the
single-view prior on held-out shapes."""

FOLDS = 8
"""Parts in which contacts are left out: the time of a prediction does not grow with their number."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """An estimate and how well it predicts readings that it was not fitted to."""

    estimate: ShapeEstimate  #: the surface.
    left_out: FloatArray
    """``(contacts,)`` rms distance of each contact from the surface fitted without it, m."""
    outline_error: float = 0.0
    """share of the silhouette that the surface misses or adds; zero without a picture."""
    open_axes: tuple[str, ...] = ()  #: axes that no reading limits, the family not counted as one.

    @property
    def misfit(self) -> float:
        """Negative log-likelihood of the left-out contacts, less a constant."""
        return float(np.log1p((self.left_out / PREDICTION_SCALE) ** 2).sum())

    @property
    def prediction_error(self) -> float:
        """Root mean square of the left-out distances, m; zero without a contact."""
        return float(np.sqrt(np.mean(self.left_out**2))) if len(self.left_out) else 0.0


def choose(fit: Candidate | None, smooth: Candidate | None, prior: ShapeEstimate | None) -> ShapeEstimate:
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
        assert smooth is not None  # there is a contact, or the search has raised
        return _as_smooth(smooth, (), "no household shape at the stated place fits the readings")
    reason = rejection_reason(fit, smooth)
    if reason is not None and smooth is not None:
        return _as_smooth(smooth, fit.estimate.flags, reason)
    found, count = fit.estimate, len(fit.left_out)
    if count >= MIN_CONTACTS and reason is None:
        return replace(found, deviation=_at_least(found, fit.prediction_error))
    few = {0: "the picture alone", 1: "1 contact"}.get(count, f"{count} contacts")
    verb = "is" if count < 2 else "are"
    untested = f"{MIN_CONTACTS} contacts are needed to test this, and there {verb} {few}"
    return replace(
        found,
        deviation=np.hypot(found.deviation, np.where(found.known_by == TOUCHED, 0.0, ASSUMED_DEVIATION)),
        not_bounded=tuple(axis for axis in "xyz" if axis in {*found.not_bounded, *fit.open_axes}),
        flags=(*found.flags, reason or f"assuming a household shape: {untested}"),
    )


def rejection_reason(fit: Candidate, smooth: Candidate | None) -> str | None:
    """State why the family is not the answer; None where it is.

    Args:
        fit: the shape family.
        smooth: the smooth surface; None without a contact.
    """
    count, details = len(fit.left_out), fit.estimate.details
    if details["strained"]:
        return "no household shape fits the readings on a bench as this is calibrated"
    if fit.outline_error > MAX_OUTLINE_ERROR:
        return (
            f"the best household shape misses or adds {100.0 * fit.outline_error:.0f} % of the outline in "
            f"the picture, and at most {100.0 * MAX_OUTLINE_ERROR:.0f} % are the camera's error"
        )
    beyond = details["beyond_m"]
    assert isinstance(beyond, float)
    if not details["sighted"] and beyond > MAX_BEYOND and count >= BLIND_CONTACTS:
        return f"the household shape lies {beyond * 1e3:.0f} mm beyond {count} contacts on average"
    if smooth is not None and fit.misfit > smooth.misfit + FAMILY_ODDS:
        return (
            f"contacts left out are {fit.prediction_error * 1e3:.1f} mm off the household shape and "
            f"{smooth.prediction_error * 1e3:.1f} mm off the smooth surface"
        )
    return None


def _as_smooth(smooth: Candidate, flags: tuple[str, ...], reason: str) -> ShapeEstimate:
    found = smooth.estimate
    name = found.details["estimator"]
    return replace(
        found,
        deviation=_at_least(found, smooth.prediction_error),
        flags=(
            *flags,
            *found.flags,
            f"{reason}: the answer is the smooth surface through all contacts ({name})",
        ),
    )


def _at_least(found: ShapeEstimate, error: float) -> FloatArray:
    """``(vertices,)`` m: no part that was not touched is surer than predictions of left-out contacts are."""
    floor = np.where(found.known_by == TOUCHED, 0.0, error)
    return np.asarray(np.maximum(found.deviation, floor))


def folds_of(contacts: int) -> list[list[int]]:
    """Divide contacts into at most ``FOLDS`` parts of about equal size, spread over their order."""
    return [list(range(k, contacts, FOLDS)) for k in range(min(FOLDS, contacts))]
