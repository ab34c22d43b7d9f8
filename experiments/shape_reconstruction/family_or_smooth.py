"""A household shape where one fits the readings, else the smooth surface through the contacts."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from experiments.shape_reconstruction.estimators.hermite import by_hermite
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.family.estimate import LEFT, LOOSE, RIVAL, family_estimate
from experiments.shape_reconstruction.family.settings import ANEW, FamilySettings
from experiments.shape_reconstruction.family.strain import STRAINED
from experiments.shape_reconstruction.pcn.glance import with_supposed
from experiments.shape_reconstruction.surface import ShapeEstimate
from harness.basics.arrays import FloatArray
from harness.basics.faces.nearest_surface import NearestSurface

ENOUGH = 6
"""Contacts from which on a smooth surface says more than a household shape that does not fit them."""

SEARCHES, BLIND_SEARCHES = 3, 2
"""Of a shape that no search fits well; of one that was not seen, at least: what no outline holds together has
many more valleys."""

UNEASY = 4.0
"""What a shape by less than ``ENOUGH`` contacts asks of the bench, above which one search more is made: of 58
such answers of development runs four do, and their mean error falls from 2.78 to 2.54 mm; by a second search
of each of the 58 to 2.48."""

BESIDE = 3.0
"""Of the deviations that the smooth surface states, root mean square: a household shape that does not fit its
contacts and is no farther from that surface has the right form, and fills better what was not touched. Of
development runs it lies between bottles that bulge, 1.7 and 2.2, and a hammer that was taken for a tray, 5.4.
"""

MANY, BEYOND = 12, 10.0e-3
"""Contacts without a picture, and m beyond them that a household shape lies in the mean, from which on it is
not believed: so many presses would have met it there."""

_SOME = 1000
"""Vertices of a surface, roughly, that are looked at."""


def by_family(
    evidence: ShapeEvidence, settings: FamilySettings | None = None, previous: ShapeEstimate | None = None
) -> ShapeEstimate:
    """The family's estimate; of an object outside of it, the smooth surface, which says so.

    With a picture a household shape that does not fit its contacts is still the answer, moved to them, where
    the smooth surface leaves it open: both say the same of what was touched, and the smooth one no more.
    Where contacts fit ill, or there is no picture, other draws are searched too; where the search goes on
    from another answer, only of an ill fit, and beside its hypotheses. Beside few contacts it is held against
    what a glance supposes, too.

    Args:
        evidence: one contact or a silhouette at least.
        settings: how much is searched.
        previous: by this function, of the same object and other readings; its hypotheses are begun at too.

    Raises:
        OutOfDomain: nothing was touched or seen.
    """
    settings = settings or FamilySettings()
    evidence = evidence if len(evidence.contacts) >= ENOUGH else with_supposed(evidence)
    found = _searched(evidence, settings) if previous is None else _went_on(evidence, settings, previous)
    why = _why_smooth(found, evidence)
    if why is None:
        return _untested(found, len(evidence.contacts))
    smooth = by_hermite(evidence, symmetric=False)  # every class of round bodies was tried
    seconds = found.seconds + smooth.seconds
    beside = _is_beside(found, smooth, evidence)
    if beside:
        return replace(_kept(found, smooth), seconds=seconds)
    open_ = {*found.not_bounded, *smooth.not_bounded}
    return replace(
        smooth,
        not_bounded=tuple(axis for axis in "xyz" if axis in open_),
        flags=(*found.flags, f"{why}: the surface is by rbf"),
        doubtful=found.doubtful,
        seconds=seconds,
        details={**smooth.details, LEFT: found.details["hypotheses"]},
    )


def _searched(evidence: ShapeEvidence, settings: FamilySettings) -> ShapeEstimate:
    """The family's estimate; of an ill fit or blind, the best of some searches, each by draws of its own.

    What one search misses another finds. Where several contacts fit two classes alike, or few strain the
    bench, one more is made: then the right one's valley was often not found. Of what fits well the least cost
    is taken, of what fits ill that whose contacts fit best, as a cost that lets contacts go is low for what
    lets most of them go: a bent body for a teapot, 7 to 12 mm off in three of four first searches, and twice
    cheaper than two others.
    """
    best = family_estimate(evidence, settings)
    seconds = best.seconds
    some = len(evidence.contacts) >= ENOUGH
    least = 1 if evidence.sighted or not some else BLIND_SEARCHES
    for more in range(1, SEARCHES):
        seldom = _is_undecided(best) if some else _strain_of(best) > UNEASY
        again = _is_ill_fitted(best) or (more == least and seldom)
        if more >= least and not again:
            break
        found = family_estimate(evidence, replace(settings, seed=settings.seed + more))
        seconds += found.seconds
        best = min(best, found, key=_how_ill)
    return replace(best, seconds=seconds)


def _went_on(evidence: ShapeEvidence, settings: FamilySettings, previous: ShapeEstimate) -> ShapeEstimate:
    """The family's estimate from another's hypotheses; of an ill fit begun anew beside what was found."""
    found = family_estimate(evidence, settings, (previous,))
    if not _is_ill_fitted(found) and _why_smooth(found, evidence) is None:
        return found
    anew = family_estimate(evidence, replace(ANEW, seed=settings.seed), (found,))
    return replace(anew, seconds=found.seconds + anew.seconds)


def _is_ill_fitted(found: ShapeEstimate) -> bool:
    """Whether no household shape that was found fits its readings well, however many they are."""
    typical = found.details["contact_cost"]
    assert isinstance(typical, float)
    return typical > LOOSE or _is_strained(found)


def _is_undecided(found: ShapeEstimate) -> bool:
    """Whether its readings fit two classes alike."""
    classes = found.details["classes"]
    assert isinstance(classes, Mapping)
    return bool(sum(weight >= RIVAL for weight in classes.values()) > 1)


def _is_strained(found: ShapeEstimate) -> bool:
    return _strain_of(found) > STRAINED


def _strain_of(found: ShapeEstimate) -> float:
    strain = found.details["strain"]
    assert isinstance(strain, float)
    return strain


def _how_ill(found: ShapeEstimate) -> tuple[bool, float]:
    """What fits well goes before what fits ill, by its cost; that by what its contacts are off."""
    ill = _is_ill_fitted(found)
    said = found.details["contact_cost" if ill else "cost"]
    assert isinstance(said, float)
    return ill, said


def _untested(found: ShapeEstimate, contacts: int) -> ShapeEstimate:
    """A household shape, which says where its contacts are too few to find it out as none."""
    if not 0 < contacts < ENOUGH:
        return found
    few = "1 contact" if contacts == 1 else f"{contacts} contacts"
    said = f"a household shape is supposed: {few} cannot tell whether it is one ({ENOUGH} can)"
    return replace(found, flags=(*found.flags, said))


def _is_beside(found: ShapeEstimate, smooth: ShapeEstimate, evidence: ShapeEvidence) -> bool:
    """Whether a household shape that does not fit its contacts is no farther from them than it may be."""
    seen = bool(found.details["foreign"]) and evidence.sighted and not _is_strained(found)
    return seen and deviations_apart(found, smooth) <= BESIDE


def _why_smooth(found: ShapeEstimate, evidence: ShapeEvidence) -> str | None:
    count, beyond = len(evidence.contacts), found.details["beyond_m"]
    assert isinstance(beyond, float)
    if found.details["foreign"] and count >= ENOUGH:
        return f"no household shape fits {count} contacts"
    if _is_strained(found) and count >= ENOUGH:
        return f"no household shape fits {count} contacts on a bench as this is calibrated"
    if not evidence.sighted and beyond > BEYOND and count >= MANY:
        return f"the household shape lies {beyond * 1e3:.0f} mm beyond {count} contacts in the mean"
    return None


def _kept(found: ShapeEstimate, smooth: ShapeEstimate) -> ShapeEstimate:
    """A household shape beside the smooth surface: nowhere less sure than that surface is."""
    stated = _nearest_deviations(smooth, found.mesh.vertices)
    return replace(found, deviation=np.minimum(found.deviation, stated))


def deviations_apart(found: ShapeEstimate, smooth: ShapeEstimate) -> float:
    """How far two answers are apart, of both surfaces' vertices the root mean square.

    Args:
        found: an answer.
        smooth: another, in whose stated deviations it is measured, each taken at the nearest of its vertices.
    """
    ours, theirs = _some(found.mesh.vertices), _some(smooth.mesh.vertices)
    towards = NearestSurface(smooth.mesh).distances(ours) / _nearest_deviations(smooth, ours)
    back = NearestSurface(found.mesh).distances(theirs) / _nearest_deviations(smooth, theirs)
    return float(np.sqrt(0.5 * (np.mean(towards**2) + np.mean(back**2))))


def _nearest_deviations(estimate: ShapeEstimate, places: FloatArray) -> FloatArray:
    return estimate.deviation[np.asarray(cKDTree(estimate.mesh.vertices).query(places)[1])]


def _some(vertices: FloatArray) -> FloatArray:
    return vertices[:: max(len(vertices) // _SOME, 1)]
