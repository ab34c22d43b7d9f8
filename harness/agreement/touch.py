"""Touch: the gel's surface, as its picture shows it and as a model of the object gives it.

The gel's pose is known to a few tenths of a millimetre and a degree, which moves most of a picture: it is
found anew at each contact (``harness.agreement.likeliest``), and what it is off by counts beside what the
surface is off by.
A network is wrong altogether at some places, so that no single contact speaks against an object; how many do
not fit is binomial where the object is right.
"""

from collections.abc import Sequence

import numpy as np
from scipy.stats import binom, chi2

from harness.agreement.agreement import Residual, SenseResiduals, SideBySide, Source
from harness.agreement.likeliest import SurfaceNoise, Surfaces, likeliest
from harness.agreement.place_noise import PlaceNoise
from harness.agreement.readings import PressedContact, refusal_notes
from harness.agreement.stated_error import gross_share
from harness.agreement.subject import Subject
from harness.basics.arrays import FloatArray
from harness.basics.errors import OutOfDomain, WrongUse

_IMPROBABLE = 0.01
"""Probability below which a contact counts as one that does not fit."""

_LEAST = 1.0e-300


def compare_touch(
    subject: Subject,
    source: Source,
    contacts: Sequence[PressedContact],
    places: PlaceNoise | None = None,
    noise: SurfaceNoise | None = None,
) -> SenseResiduals:
    """Every contact's surface of the gel against a model's.

    Args:
        subject: the object, where the scene states it.
        source: the ObjectFile's network, or the reference.
        contacts: of the run.
        places: of the gel's pose; None for the stated one.
        noise: of the surface; None for the stated one.
    """
    places, noise = places or PlaceNoise.at(subject.run.station.errors), noise or SurfaceNoise()
    residuals, notes = [], refusal_notes(contacts)
    for contact in contacts:
        if contact.refusal:
            continue
        try:
            found = likeliest(subject, source, contact, places, noise)
        except WrongUse as refusal:
            return SenseResiduals("touch", source, (), str(refusal))
        except OutOfDomain as refusal:
            notes.append(f"step {contact.step + 1} is outside of what the {source} knows: {refusal}")
            continue
        if found.compared.any():
            residuals.append(surface_residual(contact.step, found, noise, gross_share(source)))
        else:
            notes.append(f"step {contact.step + 1}: neither the picture nor the model shows a contact")
    if gross_share(source) and residuals:
        residuals.append(counted_residual(residuals, gross_share(source)))
    why = "; ".join(notes) or ("" if contacts else "no picture of the gel was recorded")
    refused = contacts[0].step if contacts and all(contact.refusal for contact in contacts) else None
    return SenseResiduals("touch", source, tuple(residuals), why, refused_at=refused)


def surface_residual(step: int, found: Surfaces, noise: SurfaceNoise, gross: float = 0.0) -> Residual:
    """What a contact's surfaces are off by at the likeliest pose.

    Args:
        step: of the run.
        found: of the contact.
        noise: of the surface.
        gross: probability that the model's surface is none of the object's.
    """
    gaps = (found.read - found.modelled)[found.compared]
    area = len(gaps) * found.pitch**2
    # So many patches of the contact are off independently of each other.
    dof = max(1.0, area / noise.length**2)
    variances = found.variances[:, found.compared]
    numbers = {
        "rms_m": float(np.sqrt(np.mean(gaps**2))),
        "sigma_m": float(np.sqrt(np.mean(variances))),
        "area_m2": area,
        "moved_m": float(np.linalg.norm(found.twist[:3])),
        "turned_rad": float(np.linalg.norm(found.twist[3:])),
        "gain": found.gain,
        "prior_chi_square": found.prior,
    }
    clipped = np.minimum(gaps**2 / variances, noise.most**2)
    chi_square = mixed(dof * clipped.mean(axis=1) + found.prior, dof, gross)
    sides = SideBySide(found.read, found.modelled, "m")
    return Residual(step, "gel surface", chi_square, dof, numbers, sides)


def mixed(chi_squares: FloatArray, dof: float, gross: float = 0.0) -> float:
    """The chi-square as improbable as ``(s,)`` ones are in the mean, of noises as probable as each other.

    Args:
        chi_squares: one for each noise.
        dof: of each.
        gross: probability of anything, however large.
    """
    if len(chi_squares) == 1 and gross == 0.0:
        return float(chi_squares[0])
    probability = gross + (1.0 - gross) * float(chi2.sf(chi_squares, dof).mean())
    return float(chi2.isf(max(probability, _LEAST), dof))


def counted_residual(residuals: Sequence[Residual], gross: float) -> Residual:
    """How improbable it is that so many contacts do not fit, as ``-2 ln p``.

    Args:
        residuals: of the contacts, at least one.
        gross: probability of each that the model's surface is none of the object's.
    """
    share = gross + (1.0 - gross) * _IMPROBABLE
    found = chi2.sf([one.chi_square for one in residuals], [one.dof for one in residuals])
    unlike = int(np.count_nonzero(found < share))
    probability = float(binom.sf(unlike - 1, len(residuals), share))
    numbers = {
        "contacts": float(len(residuals)),
        "unlike": float(unlike),
        "share_expected": share,
        "probability": probability,
    }
    chi_square = -2.0 * float(np.log(max(probability, _LEAST)))
    return Residual(residuals[-1].step, "contacts together", chi_square, 2.0, numbers)
