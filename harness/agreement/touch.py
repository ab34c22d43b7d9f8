"""Touch: the gel's surface, as its picture shows it and as a model of the object gives it.

The gel's pose is known to a few tenths of a millimetre and a degree, which moves most of a picture: it is
found anew at each contact (``harness.agreement.likeliest``), and what it is off by counts beside what the
surface is off by.
"""

from collections.abc import Sequence

import numpy as np

from harness.agreement.agreement import Residual, SenseResiduals, SideBySide, Source
from harness.agreement.likeliest import SurfaceNoise, Surfaces, likeliest
from harness.agreement.place_noise import PlaceNoise
from harness.agreement.readings import PressedContact
from harness.agreement.subject import Subject
from harness.basics.errors import OutOfDomain, WrongUse


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
    places, noise = places or PlaceNoise(), noise or SurfaceNoise()
    residuals, notes = [], []
    for contact in contacts:
        try:
            found, note = _found(subject, source, contact, places, noise)
        except WrongUse as refusal:
            return SenseResiduals("touch", source, (), str(refusal))
        if found.compared.any():
            residuals.append(surface_residual(contact.step, found, noise))
        else:
            note = "neither the picture nor the model shows a contact"
        notes += [f"step {contact.step + 1}: {note}"] if note else []
    why = "; ".join(notes) or ("" if contacts else "no picture of the gel was recorded")
    return SenseResiduals("touch", source, tuple(residuals), why)


def _found(
    subject: Subject, source: Source, contact: PressedContact, places: PlaceNoise, noise: SurfaceNoise
) -> tuple[Surfaces, str]:
    """The likeliest surfaces, by the reference where no network was made for the place; and what to note."""
    try:
        return likeliest(subject, source, contact, places, noise), ""
    except OutOfDomain as refusal:
        if source == "reference":
            raise
        return likeliest(subject, "reference", contact, places, noise), f"by the reference, as {refusal}"


def surface_residual(step: int, found: Surfaces, noise: SurfaceNoise) -> Residual:
    """What a contact's surfaces are off by at the likeliest pose."""
    gaps = (found.read - found.modelled)[found.compared]
    area = len(gaps) * found.pitch**2
    # So many patches of the contact are off independently of each other.
    dof = max(1.0, area / noise.length**2)
    variance = found.variance[found.compared]
    numbers = {
        "rms_m": float(np.sqrt(np.mean(gaps**2))),
        "sigma_m": float(np.sqrt(np.mean(variance))),
        "area_m2": area,
        "moved_m": float(np.linalg.norm(found.twist[:3])),
        "turned_rad": float(np.linalg.norm(found.twist[3:])),
        "gain": found.gain,
        "prior_chi_square": found.prior,
    }
    chi_square = dof * float(np.mean(np.minimum(gaps**2 / variance, noise.most**2))) + found.prior
    sides = SideBySide(found.read, found.modelled, "m")
    return Residual(step, "gel surface", chi_square, dof, numbers, sides)
