"""How far off contacts are, by what is stated and by how well they fit."""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import FloatArray

STATED_CONTACTS = 8.0
"""Contacts whose misfits would say as much of the scale of a contact's error as what the station states."""

FITTED = 4
"""Unknowns that contacts alone fix: size, place and yaw. As many contacts lie on the surface whatever their
error, and say nothing of its scale."""


@dataclass(frozen=True)
class ContactScale:
    """How far off all contacts are alike: stated, and told by their own misfits.

    The precision has a gamma distribution about the stated one; summed over it, the contacts together have
    Student's distribution, so that contacts which fit well are believed more, and one bad one less.

    Attributes:
        shape: of the gamma distribution once the contacts are there.
        stated: half a sum of squares that the stated error counts as, in the unit of the misfits.
    """

    shape: float
    stated: float

    @classmethod
    def of(cls, sigma: float, contacts: int) -> "ContactScale":
        """Of so many contacts whose stated error each is ``sigma`` units."""
        half = 0.5 * STATED_CONTACTS
        return cls(half + 0.5 * max(contacts - FITTED, 0), half * sigma**2)

    def precision(self, misfit: FloatArray) -> FloatArray:
        """That is expected of a contact, for half sums of squares of misfits."""
        return np.asarray(self.shape / (self.stated + misfit))

    def cost(self, misfit: FloatArray) -> FloatArray:
        """Minus the logarithm of the density for half sums of squares of misfits, 0 for none."""
        return np.asarray(self.shape * np.log1p(misfit / self.stated))
