"""The places that touches met, thinned so that no patch outweighs another."""

from dataclasses import dataclass

import numpy as np

from experiments.shape_reconstruction.evidence import ShapeEvidence
from harness.basics.arrays import FloatArray, IntArray
from harness.basics.errors import FitRefused
from harness.sim.solid.surface_samples import thin

SPACING = 6.0e-3
"""Smallest distance between samples that face the same way, m."""

MOST = 260
"""Samples: a surface through them is solved in a tenth of a second."""

_WIDER = 1.25


@dataclass(frozen=True, eq=False)
class ContactSamples:
    """Places of the object's surface."""

    points: FloatArray  #: ``(n, 3)`` m in ``stand``.
    normals: FloatArray  #: ``(n, 3)`` unit, out of the object.
    sigmas: FloatArray  #: ``(n,)`` m, one standard deviation of each point along its normal.
    normal_sigmas: FloatArray  #: ``(n,)`` rad, of each normal.
    touches: IntArray  #: ``(n,)`` which of ``evidence.contacts`` each is of.

    def of(self, rows: IntArray) -> "ContactSamples":
        """Some of them."""
        return ContactSamples(
            self.points[rows],
            self.normals[rows],
            self.sigmas[rows],
            self.normal_sigmas[rows],
            self.touches[rows],
        )


def all_samples(evidence: ShapeEvidence) -> ContactSamples:
    """Every place of every contact.

    Raises:
        FitRefused: no touch met the object.
    """
    contacts = evidence.contacts
    if not contacts:
        raise FitRefused(
            f"none of {len(evidence.touches)} touches met the object, so nothing says where its surface is; "
            "touch it, or answer by the picture alone"
        )
    counts = [len(contact.points) for contact in contacts]
    return ContactSamples(
        np.concatenate([contact.points for contact in contacts]),
        np.concatenate([contact.normals for contact in contacts]),
        np.repeat([contact.sigma for contact in contacts], counts),
        np.repeat([contact.normal_sigma for contact in contacts], counts),
        np.repeat(np.arange(len(contacts)), counts),
    )


def thinned(samples: ContactSamples, spacing: float = SPACING, most: int = MOST) -> ContactSamples:
    """Those of which no two that face the same way are closer than ``spacing`` m, ``most`` at most.

    Where there are more, the spacing is widened until there are not.
    """
    points, normals = np.ascontiguousarray(samples.points), np.ascontiguousarray(samples.normals)
    chosen = thin(points, normals, spacing)
    while len(chosen) > most:
        spacing *= _WIDER
        chosen = thin(points, normals, spacing)
    return samples.of(chosen)
